"""What mends a design: changes of its spec as values (`Fix`), where they come from, and the search for one.

Nothing here judges a design: `checks` tries a fix, lays it out, estimates and checks it, as far as the budget goes.
"""
