"""Results of field solutions from earlier builds, in the user's cache folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sitscad.kernels import solve_cache as solutions
from sitscad.kernels.solve_cache import Solutions
from sitscad.package.folder import replace_file
from sitscad.package.manifest import code_hash

MOST_CACHED = 64_000_000
"""Approximate limit (bytes) for all solution files in the user's cache. Above it, the oldest files are removed."""


@contextmanager
def cached_solutions(name: str, writes: bool = True, store: Solutions | None = None) -> Iterator[None]:
    """Reuse field solutions from `store`, or from earlier builds of packages with this name.

    They are stored in ``NAME.solved``, in the folder given by the environment variable ``SITSCAD_CACHE`` (an absolute
    path). By default this is ``sitscad`` in the user's cache folder. If ``SITSCAD_CACHE`` is empty, no file is used. If
    the file is missing, solutions are computed again. New solutions are stored only if `writes`.
    """
    home = os.environ.get("XDG_CACHE_HOME", "")
    default = os.path.join(home if os.path.isabs(home) else os.path.expanduser("~/.cache"), "sitscad")
    cache, store = os.environ.get("SITSCAD_CACHE", default), store or solutions.Solutions()
    path, has_place = Path(cache) / f"{name}.solved", os.path.isabs(cache)
    if has_place and not store.known:
        wrong = (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)
        with suppress(*wrong):
            if path.is_file():  # reading a pipe would block
                with path.open("rb") as stream:
                    store.known = solutions.read_cache(stream.read(2 * solutions.MOST), code_hash()).known
    before = set(store.known)
    with solutions.store_results(store):
        yield
    is_new = not before >= set(store.asked)
    store.forget()
    if not (is_new and writes and has_place):
        return
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, store.as_bytes(code_hash()))
        room = MOST_CACHED
        cached = [each for each in path.parent.glob("*.solved") if each.is_file()]
        for old in sorted(cached, key=lambda each: each.stat().st_mtime, reverse=True):
            room -= old.stat().st_size
            if room < 0:
                old.unlink()
