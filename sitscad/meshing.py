"""A session of gmsh, for meshes of tetrahedra (formats) and of triangles over copper (extraction)."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from types import ModuleType


@contextmanager
def session(gmsh: ModuleType, name: str, options: Mapping[str, float]) -> Iterator[None]:
    """A model of its own, with every option that matters set. A session that the caller has open survives."""
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        with suppress(AttributeError, ValueError):  # Windows has no such signal; a thread beside the main one sets none
            # gmsh has it end the process: a server would die with the first listener that goes away
            signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))
    for option, value in options.items():
        gmsh.option.setNumber(option, value)
    gmsh.model.add(name)
    try:
        yield
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()
