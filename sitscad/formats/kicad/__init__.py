"""A KiCad 9 project: board, rules, libraries of footprints and symbols."""
