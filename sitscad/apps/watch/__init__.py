"""Watch mode: a spec is evaluated after each save, and the changes are shown on the terminal and on a web page."""
