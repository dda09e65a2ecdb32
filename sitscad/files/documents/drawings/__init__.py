"""Dimensioned drawings on A4 sheets: board, contacts, stack-up, pieces over the coils, panel, jaw and failed fits."""
