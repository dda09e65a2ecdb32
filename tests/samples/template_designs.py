"""Designs of the templates, which tests of one process share: each is laid out, estimated and analysed once."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from sitscad.estimates.design import Design
from sitscad.spec.load import load

TEMPLATES = Path(__file__).parents[2] / "templates"


@lru_cache(6)
def template_design(name: str) -> Design:
    """Return the design of a template. Tests that count, replace or time its parts need a design of their own."""
    return Design(load(TEMPLATES / f"{name}.yaml"))
