"""Cache of slow solutions by their exact inputs: inputs equal to the last bit return the stored result.

The cache is active only while a store is open. `build` has its store in the user's cache folder, and `watch` has its
store in memory (`store_results`). A check stores results for the designs that it tries (`cache_results`). A key covers
every number on which a result depends. A cache file names the code and the libraries that computed its results. Output
is identical byte for byte with and without the cache.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeAlias

import numpy as np

from sitscad.basics.digest import sha256
from sitscad.basics.version import __version__

Answer: TypeAlias = tuple[Any, ...]
"""Result of one solution: a tuple of arrays of floats or complex numbers."""

KINDS = {"<f8": np.float64, "<c16": np.complex128}
"""NumPy types of the arrays in a cache file, by the type code in its index."""

MOST, HEAD = 16_000_000, 200
"""Largest size of a store (bytes), and size counted for the key of each result (bytes).

The results of one design take half a megabyte.
"""


class Solutions:
    """Store of results that can be written to a cache file.

    `known` maps the SHA-256 hash of the inputs to the result. `asked` holds the hashes used since the last call of
    `forget`, in the order of their first use.
    """

    def __init__(self, results: Mapping[str, Answer] | None = None) -> None:
        self.known = dict(results or {})
        self.asked: dict[str, None] = {}

    def result_of(self, inputs: tuple[object, ...], solve: Callable[[], Answer]) -> Answer:
        """Return the stored result for some inputs. If there is none, call `solve` and store its result."""
        digest = sha256()
        for part in inputs:
            text = part if isinstance(part, bytes) else getattr(part, "cache_key", None) or repr(part).encode("utf-8")
            digest.update(f"{len(text)}:".encode("ascii") + text)
        key = digest.hexdigest()
        if key not in self.known:
            self.known[key] = _make_read_only(solve())
        self.asked[key] = None
        return self.known[key]

    def forget(self) -> None:
        """Remove results until the store has at most `MOST` bytes. Results used since the last call go last."""
        results, size = dict[str, Answer](), 0
        for key in dict.fromkeys((*self.asked, *self.known)):
            size += HEAD + sum(part.nbytes for part in self.known[key])
            if size > MOST:
                break
            results[key] = self.known[key]
        self.known, self.asked = results, {}

    def as_bytes(self, by: str) -> bytes:
        """Return the content of a cache file: a SHA-256 hash of the rest, a line of JSON as index, and the arrays.

        `by` identifies the code that computed the results.
        """
        index = {key: [[part.dtype.str, *part.shape] for part in answer] for key, answer in self.known.items()}
        head = json.dumps({"by": _cache_conditions(by), "solutions": index}).encode("ascii")
        content = b"".join([head, b"\n", *(part.tobytes() for answer in self.known.values() for part in answer)])
        return sha256(content).hexdigest().encode("ascii") + b"\n" + content


class Memo:
    """Store of results in memory, by the tuple of their inputs. It is faster than `Solutions`, which hashes inputs."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], Answer] = {}

    def result_of(self, inputs: tuple[object, ...], solve: Callable[[], Answer]) -> Answer:
        """Return the stored result for some inputs. If there is none, call `solve` and store its result."""
        if inputs not in self._known:
            self._known[inputs] = _make_read_only(solve())
        return self._known[inputs]


def _make_read_only(answer: Answer) -> Answer:
    """Return the arrays of a result after making them read-only."""
    for part in answer:
        part.setflags(write=False)
    return answer


def read_cache(file: bytes, by: str) -> Solutions:
    """Return the results in the content of a cache file.

    Empty if the file is damaged. Also empty if its results come from other code (`by`), or from another version of
    sitscad or NumPy, or another processor type.
    """
    digest, _, content = file.partition(b"\n")
    if sha256(content).hexdigest().encode("ascii") != digest:
        return Solutions()
    head, _, _ = content.partition(b"\n")
    document, place = json.loads(head), len(head) + 1
    if document["by"] != _cache_conditions(by):
        return Solutions()
    results: dict[str, Answer] = {}
    for key, parts in document["solutions"].items():
        answer = []
        for kind, *shape in parts:
            count = int(np.prod(shape, dtype=np.int64))
            answer.append(np.frombuffer(content, KINDS[kind], count, place).reshape(shape))
            place += answer[-1].nbytes
        results[key] = tuple(answer)
    return Solutions(results)


def _cache_conditions(by: str) -> list[str]:
    """Return the conditions of a cached result: the code (`by`), two versions and the processor type.

    The versions are of sitscad and NumPy.
    """
    return [by, __version__, np.__version__, platform.machine()]


_open: ContextVar[Solutions | Memo | None] = ContextVar("_open", default=None)


@contextmanager
def store_results(store: Solutions | Memo) -> Iterator[None]:
    """Store and look up all results of `cached_solution` in `store` inside the context."""
    before = _open.set(store)
    try:
        yield
    finally:
        _open.reset(before)


@contextmanager
def cache_results() -> Iterator[None]:
    """Cache all results of `cached_solution` inside the context: in the open store, or in a new `Memo`."""
    with store_results(_open.get() or Memo()):
        yield


def cached_solution(question: Callable[[], Sequence[object]], solve: Callable[[], Answer]) -> Answer:
    """Return the result for some inputs: from the open store if it has the result, else from `solve`.

    Parameters
    ----------
    question : Callable[[], sequence of object]
            function that returns the inputs. It is called only if a store is open. Inputs are bytes, or hashable values
        with a complete `repr`. A value may have this text as bytes in an attribute `cache_key`.
    solve : Callable[[], Answer]
        function that computes the result

    Notes
    -----
    Stored arrays are read-only.
    """
    store = _open.get()
    return solve() if store is None else store.result_of(tuple(question()), solve)
