"""What mends a design: changes of its spec as values (`Fix`), where they come from, and what a search for one may cost.

Nothing here judges a design: `checks` tries a fix, lays it out, estimates and checks it, as far as the budget goes.
"""
