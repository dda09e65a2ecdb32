"""The archive of a study: a line a design as it was evaluated, appended to and never rewritten; cache, checkpoint and
audit at once.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any

from sitscad.study.changes import Changes
from sitscad.study.evaluation import Evaluation, of_json

ARCHIVE = "archive.jsonl"


class Archive:
    """Evaluations by the keys that `Base.key` gives; of a file where a path is given, else in memory alone.

    Only where each line begins is held, and lines are read again when they are asked for: a hundred thousand take 30 MB
    and not 600. A line that cannot be read is passed by: the last one may be torn where the process was killed. A file
    ends in a whole line before it is appended to.
    """

    def __init__(self, path: Path | None = None, again: bool = False) -> None:
        self._starts: dict[bytes, int] = {}
        self._stream: IO[bytes] = io.BytesIO()
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("w+b" if again else "a+b")
            self._stream.seek(0)
        self._end, is_whole = 0, True
        for line in self._stream:
            if (key := _key(line)) is not None:
                self._starts[key] = self._end
            self._end, is_whole = self._end + len(line), line.endswith(b"\n")
        if not is_whole:
            self._write(b"\n")

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def __len__(self) -> int:
        return len(self._starts)

    def evaluation(self, key: str, measures: Iterable[str]) -> Evaluation | None:
        """The evaluation under a key, where it was asked for these measures, too."""
        said = self.said(key)
        if said is None or not all(name in said["values"] or name in said["absent"] for name in measures):
            return None
        return of_json(said)

    def said(self, key: str) -> Mapping[str, Any] | None:
        """What was kept under a key, as plain values."""
        start = self._starts.get(key.encode())
        if start is None:
            return None
        self._stream.seek(start)
        return dict(json.loads(self._stream.readline()))

    def add(self, key: str, changes: Changes, said: Mapping[str, Any]) -> None:
        """Keep plain values; what their line says is on its way to the disk when this returns."""
        self._starts[key.encode()] = self._end
        line = {"key": key, "changes": dict(changes), **said}
        self._write(json.dumps(line, allow_nan=False).encode("ascii") + b"\n")

    def _write(self, line: bytes) -> None:
        self._stream.seek(0, io.SEEK_END)
        self._stream.write(line)
        self._stream.flush()
        self._end += len(line)


def _key(line: bytes) -> bytes | None:
    """The key of a whole line that `Archive.add` could have written; None of any other."""
    try:
        said = json.loads(line)
        if "values" in said:
            of_json(said)
        return said["key"].encode() if isinstance(said["changes"], dict) else None
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
