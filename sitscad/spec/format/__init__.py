"""The vocabulary in which the format is declared: kinds of value, sections of keys, what is read by them."""
