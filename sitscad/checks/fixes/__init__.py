"""Changes of a spec that may mend a design, as values (`Fix`), their sources, and the search for a change.

This folder does not judge designs. `checks` tries a fix, lays it out, estimates and checks it, within a budget.
"""
