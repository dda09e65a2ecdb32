"""Functions of modules that are imported when first called, because the checks of most specs do not need them."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any


def late(module: str, name: str) -> Callable[..., Any]:
    """Return a function that calls the function or class `name` of `module`. The module is imported at the first call.

    `tests/test_import_map.py` counts it as an import, and lists every use with its reason.
    """
    return lambda *values, **options: getattr(import_module(module), name)(*values, **options)
