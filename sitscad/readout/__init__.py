"""Converters: what each chip can drive and how it is set up."""
