"""Quantities and their units, frozen values, findings, checks of arguments, the version: what every room stands on."""
