"""The commented specs that `sitscad new` hands out: inside the package once installed, beside it in a source tree."""

from __future__ import annotations

import importlib.resources
from importlib.resources.abc import Traversable
from pathlib import Path


def directory() -> Traversable:
    """Where the templates are. An installed sitscad carries them as ``sitscad/templates``; a source tree (or an
    editable installation of one) keeps them in ``templates/`` beside the package. Raises FileNotFoundError when neither
    is there.
    """
    inside = importlib.resources.files("sitscad") / "templates"
    if inside.is_dir():
        return inside
    beside = Path(__file__).parents[2] / "templates"
    if beside.is_dir():
        return beside
    raise FileNotFoundError(f"sitscad's templates are neither in {inside} nor in {beside}: install sitscad again")


def names() -> tuple[str, ...]:
    """The templates' names, sorted: the file names without ``.yaml``."""
    return tuple(sorted(entry.name[:-5] for entry in directory().iterdir() if entry.name.endswith(".yaml")))


def read(name: str) -> str:
    """The text of one template. Raises KeyError for a name that `names` does not list."""
    if name not in names():
        raise KeyError(name)
    return (directory() / f"{name}.yaml").read_text(encoding="utf-8")
