"""Specs with comments that `sitscad new` copies. They are in the installed package, or beside it in a source tree."""

from __future__ import annotations

import importlib.resources
from importlib.resources.abc import Traversable
from pathlib import Path


def directory() -> Traversable:
    """Return the folder of the templates. Raises FileNotFoundError if there is none.

    An installed sitscad has them in ``sitscad/templates``. A source tree or an editable installation has them in
    ``templates/`` beside the package.
    """
    inside = importlib.resources.files("sitscad") / "templates"
    if inside.is_dir():
        return inside
    beside = Path(__file__).parents[2] / "templates"
    if beside.is_dir():
        return beside
    raise FileNotFoundError(f"sitscad's templates are neither in {inside} nor in {beside}: install sitscad again")


def names() -> tuple[str, ...]:
    """Return the names of the templates, sorted: the file names without ``.yaml``."""
    return tuple(sorted(entry.name[:-5] for entry in directory().iterdir() if entry.name.endswith(".yaml")))


def read(name: str) -> str:
    """Return the text of a template. Raises KeyError if `names` does not list it."""
    if name not in names():
        raise KeyError(name)
    return (directory() / f"{name}.yaml").read_text(encoding="utf-8")
