"""Changes of a spec that may remove findings (`Fix`), the functions that propose them, and the search for a change.

This folder does not check designs. `checks` lays out, estimates and checks each trial change, within a limit of trials.
"""
