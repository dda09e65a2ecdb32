"""The sensor's data sheet, as its maker would give it: what it feels, how finely, and what it errs by."""
