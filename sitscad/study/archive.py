"""The archive of a study: a line a design as it was evaluated, appended to and never rewritten; cache, checkpoint and
audit at once.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from sitscad.study.changes import Changes
from sitscad.study.evaluation import Evaluation, of_json

ARCHIVE = "archive.jsonl"


class Archive:
    """Evaluations by the keys that `Base.key` gives; of a file where a path is given, else in memory alone.

    A line that cannot be read is passed by: the last one may be torn where the process was killed. A file ends in a
    whole line before it is appended to.
    """

    def __init__(self, path: Path | None = None, again: bool = False) -> None:
        self._known: dict[str, Mapping[str, Any]] = {}
        self._stream: IO[bytes] | None = None
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            if not again:
                self._known = dict(_read(path))
            self._stream = path.open("wb" if again else "ab")
            if not again and not _ends_whole(path):
                self._stream.write(b"\n")

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._stream is not None:
            self._stream.close()

    def __len__(self) -> int:
        return len(self._known)

    def evaluation(self, key: str, measures: Iterable[str]) -> Evaluation | None:
        """The evaluation under a key, where it was asked for these measures, too."""
        said = self.said(key)
        if said is None or not all(name in said["values"] or name in said["absent"] for name in measures):
            return None
        return of_json(said)

    def said(self, key: str) -> Mapping[str, Any] | None:
        """What was kept under a key, as plain values."""
        return self._known.get(key)

    def add(self, key: str, changes: Changes, said: Mapping[str, Any]) -> None:
        """Keep plain values; what their line says is on its way to the disk when this returns."""
        self._known[key] = said
        if self._stream is not None:
            line = {"key": key, "changes": dict(changes), **said}
            self._stream.write(json.dumps(line, allow_nan=False).encode("ascii") + b"\n")
            self._stream.flush()


def _read(path: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """What every whole line says, by its key."""
    if not path.exists():
        return
    with path.open("rb") as stream:
        for line in stream:
            try:
                said = json.loads(line)
                key = str(said.pop("key"))
                said.pop("changes")
                if "values" in said:
                    of_json(said)
                yield key, said
            except (ValueError, KeyError, TypeError, AttributeError):
                continue


def _ends_whole(path: Path) -> bool:
    with path.open("rb") as stream:
        stream.seek(0, 2)
        if not stream.tell():
            return True
        stream.seek(-1, 2)
        return stream.read(1) == b"\n"
