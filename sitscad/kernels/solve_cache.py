"""Solutions that take long, kept by what they solve: a question that is the same to the last bit has the answer that it
had before.

Nothing is kept unless somebody opens a store: `build`, whose solutions lie in the user's cache, and `watch`. Questions
hold every number that an answer hangs on, and a file says by which code and libraries its answers were found: with it
and without it come the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeAlias

import numpy as np

from sitscad.basics.version import __version__

Answer: TypeAlias = tuple[Any, ...]
"""Arrays of floats or complex numbers."""

KINDS = {"<f8": np.float64, "<c16": np.complex128}
"""What numbers a file may hold."""

MOST, HEAD = 16_000_000, 200
"""Bytes that a store keeps at most, and what the name of an answer takes of them; a design's are half a megabyte."""


class Solutions:
    """Answers by the hash of their question, and which of them were asked for since `forget` was called last."""

    def __init__(self, known: Mapping[str, Answer] | None = None) -> None:
        self.known = dict(known or {})
        self.asked: dict[str, None] = {}

    def forget(self) -> None:
        """Keep what was asked for since the last time and then what was known before, up to `MOST` bytes."""
        found, size = dict[str, Answer](), 0
        for key in dict.fromkeys((*self.asked, *self.known)):
            size += HEAD + sum(part.nbytes for part in self.known[key])
            if size > MOST:
                break
            found[key] = self.known[key]
        self.known, self.asked = found, {}

    def as_bytes(self, by: str) -> bytes:
        """A file of all of them: a hash of what follows, a line of JSON, and the numbers."""
        import json  # only builds keep a file

        index = {key: [[part.dtype.str, *part.shape] for part in answer] for key, answer in self.known.items()}
        head = json.dumps({"by": _setting(by), "solutions": index}).encode("ascii")
        content = b"".join([head, b"\n", *(part.tobytes() for answer in self.known.values() for part in answer)])
        return _sha256(content).hexdigest().encode("ascii") + b"\n" + content


def read(file: bytes, by: str) -> Solutions:
    """The answers in a file; none where it is damaged, or its answers come from other code."""
    import json  # only builds keep a file

    digest, _, content = file.partition(b"\n")
    if _sha256(content).hexdigest().encode("ascii") != digest:
        return Solutions()
    head, _, _ = content.partition(b"\n")
    document, place = json.loads(head), len(head) + 1
    if document["by"] != _setting(by):
        return Solutions()
    known: dict[str, Answer] = {}
    for key, parts in document["solutions"].items():
        answer = []
        for kind, *shape in parts:
            count = int(np.prod(shape, dtype=np.int64))
            answer.append(np.frombuffer(content, KINDS[kind], count, place).reshape(shape))
            place += answer[-1].nbytes
        known[key] = tuple(answer)
    return Solutions(known)


def _sha256(content: bytes = b"") -> Any:
    import hashlib  # loads OpenSSL, which a check does not need

    return hashlib.sha256(content)


def _setting(by: str) -> list[str]:
    import platform

    return [by, __version__, np.__version__, platform.machine()]


_open: ContextVar[Solutions | None] = ContextVar("_open", default=None)


@contextmanager
def keeping(store: Solutions) -> Iterator[None]:
    """Answers are looked for in a store, and put there, while this lasts."""
    before = _open.set(store)
    try:
        yield
    finally:
        _open.reset(before)


def solved(question: Callable[[], Sequence[object]], solve: Callable[[], Answer]) -> Answer:
    """The answer to a question: of the open store where it knows it, else by `solve`. A `question` is asked only where
    a store is open; its parts are bytes, or values whose `repr` tells all of them. Answers are nobody's to change.
    """
    store = _open.get()
    if store is None:
        return solve()
    digest = _sha256()
    for part in question():
        said = part if isinstance(part, bytes) else repr(part).encode("utf-8")
        digest.update(f"{len(said)}:".encode("ascii") + said)
    key = digest.hexdigest()
    if key not in store.known:
        store.known[key] = answer = solve()
        for part in answer:
            part.setflags(write=False)
    store.asked[key] = None
    return store.known[key]
