"""What the commands ask of the C library's memory."""

from __future__ import annotations

import sys

KEPT, MAPPED = 256 << 20, 32 << 20
"""Bytes that are freed and kept for what comes next, and from which on an array is the system's by itself: the most
that the library takes (mallopt(3))."""

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers of its settings, as in malloc.h."""


def keep_freed_memory() -> bool:
    """Have the C library keep freed memory for this process's next arrays; whether it does.

    Else every array of some hundred kilobytes is taken from the system anew and cleared by it, which is a tenth to a
    fifth of a check's time. Only GNU's library is asked: of others nothing is known.
    """
    if not sys.platform.startswith("linux"):
        return False
    import ctypes  # numpy loads it anyway

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and all([mallopt(_MMAP_THRESHOLD, MAPPED), mallopt(_TRIM_THRESHOLD, KEPT)])
