"""The evaluation of a design, and the archive file with all evaluations of a study.

An evaluation has values with error bounds, and the rules that refuse the design. The archive has one line per
evaluation. Lines are appended and never rewritten. The archive is a cache, a checkpoint and a record.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from functools import cache
from pathlib import Path
from sys import intern
from typing import IO, Any

from sitscad.basics.record import record

OK, FAILS, UNKNOWN = "ok", "fails", "unknown"
"""Verdicts: no rule refuses the design; a rule refuses it; no rule refuses it, but some rules are undecided."""

FULL, SCREEN = "full", "screen"
"""Levels: the full level equals `check` without hints; the screen level is fast and states the error of each value."""

UNDRAWN = frozenset({"SIT111", "SIT112", "SIT113", "SIT118", "SIT119"})
"""Rules on missing leads. The electrical values of such designs do not include the missing leads."""


LEAST_BREACH = 0.05
"""Smallest size of a breach. It is added to the relative distance from the limit, so that two breaches outweigh one."""


@record
class Breach:
    """Violation of a limit by a design, or a margin below one standard deviation.

    ``measured`` and ``limit`` are SI values in ``unit``; None if the rule has no values. ``sigma`` is the margin in
    standard deviations if the limit is met with a margin of less than one; else None.
    """

    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    sigma: float | None = None

    @property
    def size(self) -> float:
        """Size of the breach as a cost in the search.

        It is `LEAST_BREACH` plus the distance from the limit, divided by the larger magnitude of value and limit. It is
        1 if the rule has no values. If the limit is met with a margin below one standard deviation, the distance is the
        part that is missing to one standard deviation.
        """
        if self.measured is None or self.limit is None:
            return 1.0
        distance = abs(self.measured - self.limit) * (1.0 if self.sigma is None else 1.0 / max(self.sigma, 1e-9) - 1.0)
        return LEAST_BREACH + distance / max(abs(self.limit), abs(self.measured), 1e-300)

    def as_json(self) -> list[Any]:
        """Return [value, limit, unit], and the margin in standard deviations if it is set."""
        return [self.measured, self.limit, self.unit, *(() if self.sigma is None else (self.sigma,))]


@record
class Evaluation:
    """The evaluation of one design.

    ``values`` are pairs of value and error bound (SI units) by measure. ``absent`` gives the reason for each requested
    measure without a value. ``refused`` are the rules that find an error, each with its largest breach. ``warned`` are
    the rules that warn and find no error. ``unknown`` are rules that apply to the design and could not be decided.
    """

    values: Mapping[str, tuple[float, float]]
    absent: Mapping[str, str] = field(default_factory=dict)
    refused: Mapping[str, Breach] = field(default_factory=dict)
    warned: Mapping[str, Breach] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    level: str = FULL

    def __repr__(self) -> str:
        """Return a line with the verdict, the rules and the first values."""
        rules = [*self.refused, *(f"{rule} warns" for rule in self.warned)]
        figures = [f"{name} {value:.4g}" for name, (value, _) in self.values.items()]
        return f"<Evaluation {self.verdict}: {', '.join([*rules[:6], *figures[:4]])}{', ...' * (len(figures) > 4)}>"

    @property
    def verdict(self) -> str:
        """`OK`, `FAILS` or `UNKNOWN`.

        At the full level, a design passes if `check` passes it, even with unchecked rules.
        """
        return FAILS if self.refused else UNKNOWN if self.unknown and self.level != FULL else OK

    @property
    def refused_by(self) -> tuple[str, ...]:
        """Rules that find an error."""
        return tuple(self.refused)

    @property
    def warned_by(self) -> tuple[str, ...]:
        """Rules that warn and find no error."""
        return tuple(self.warned)

    def as_json(self) -> dict[str, Any]:
        """Return plain values, which `evaluation_from_json` reads back."""
        return {
            "level": self.level, "verdict": self.verdict,
            "values": {name: list(pair) for name, pair in self.values.items()}, "absent": dict(self.absent),
            "refused": {rule: breach.as_json() for rule, breach in self.refused.items()},
            "warned": {rule: breach.as_json() for rule, breach in self.warned.items()},
            "unknown": list(self.unknown),
        }


def evaluation_from_json(data: Mapping[str, Any]) -> Evaluation:
    """Return the evaluation from values of `Evaluation.as_json`.

    Equal texts and tuples of many designs share one object in memory. Raises KeyError, TypeError or ValueError for
    other values.
    """
    values = {intern(name): (_figure(value), _figure(error)) for name, (value, error) in data["values"].items()}
    absent = {intern(name): intern(why) for name, why in data["absent"].items()}
    refused, warned = ({intern(rule): _breach(*breach) for rule, breach in data[part].items()}
                       for part in ("refused", "warned"))
    unknown = _interned_rules(tuple(map(intern, data["unknown"])))
    level = {FULL: FULL, SCREEN: SCREEN}[data["level"]]
    return Evaluation(values, absent or NONE, refused or NONE, warned or NONE, unknown, level)


def _breach(measured: float | None, limit: float | None, unit: str, *sigma: float) -> Breach:
    for each in (measured, limit, *sigma):
        if each is not None:
            _figure(each)
    return Breach(measured, limit, intern(unit), *sigma)


def _figure(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("no figure is without end")
    return float(value)


@record
class UnitEvaluation:
    """Evaluation of one simulated sensor of a design, with its own manufacturing errors.

    ``passes`` is True if it breaks no rule, and ``broken_rules`` lists the broken rules. ``is_computed`` is False if a
    computation failed. ``values`` holds its measures in SI units.
    """

    passes: bool
    broken_rules: tuple[str, ...]
    is_computed: bool
    values: Mapping[str, float]

    def as_json(self) -> list[Any]:
        """Return values for JSON, which `unit_from_json` reads."""
        return [self.passes, list(self.broken_rules), self.is_computed, dict(self.values)]


def unit_from_json(data: Sequence[Any]) -> UnitEvaluation:
    """Return the simulated sensor from values of `UnitEvaluation.as_json`.

    Raises the errors of `evaluation_from_json`.
    """
    is_good, broken, is_computed, values = data
    figures = {intern(name): _figure(value) for name, value in values.items()}
    return UnitEvaluation(bool(is_good), tuple(map(intern, broken)), bool(is_computed), figures)


NONE: Mapping[str, Any] = {}
"""An empty mapping that is shared to save memory."""


@cache
def _interned_rules(rules: tuple[str, ...]) -> tuple[str, ...]:
    return rules


ARCHIVE = "archive.jsonl"


class Archive:
    """Evaluations by their keys (`Base.key`), in a file if a path is given, else in memory.

    Only the start position of each line is in memory, and lines are read on demand. For a hundred thousand evaluations,
    this takes 30 MB instead of 600 MB. Each line begins with a hash of the rest. A line that does not match its hash
    was changed, or incomplete when a process was stopped. It is skipped, and `damaged` counts it. If the last line is
    incomplete, it is ended before lines are appended. Two processes can append to one file.
    """

    def __init__(self, path: Path | None = None, again: bool = False) -> None:
        self._starts: dict[bytes, int] = {}
        self.damaged = 0
        self._stream: IO[bytes] = io.BytesIO()
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            if again:
                path.write_bytes(b"")
            self._stream = path.open("a+b")
            self._stream.seek(0)
        start, is_whole = 0, True
        for line in self._stream:
            if (body := _line_body(line)) is not None:
                self._starts[json.loads(body)["key"].encode()] = start
            self.damaged += body is None and bool(line.strip())
            start, is_whole = start + len(line), line.endswith(b"\n")
        if not is_whole:
            self._write(b"\n")

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def __len__(self) -> int:
        return len(self._starts)

    def evaluation(self, key: str, measures: Sequence[str]) -> Evaluation | None:
        """Return the evaluation under a key. None if there is none, or if it lacks one of these measures."""
        stored = self.read_values(key)
        if stored is None or "values" not in stored:
            return None
        requested = {part: {name: stored[part][name] for name in measures if name in stored[part]}
                 for part in ("values", "absent")}
        is_asked = all(name in requested["values"] or name in requested["absent"] for name in measures)
        return evaluation_from_json({**stored, **requested}) if is_asked else None

    def units(self, key: str) -> list[UnitEvaluation] | None:
        """Return the simulated sensors under a key. None if there are none."""
        stored = self.read_values(key)
        return None if stored is None or "units" not in stored else list(map(unit_from_json, stored["units"]))

    def read_values(self, key: str) -> Mapping[str, Any] | None:
        """Return the values under a key, or None. Raises OSError if another program has changed the file."""
        start = self._starts.get(key.encode())
        if start is None:
            return None
        self._stream.seek(start)
        body = _line_body(self._stream.readline())
        stored = {} if body is None else json.loads(body)
        if stored.get("key") == key:
            return dict(stored)
        raise OSError(f"{ARCHIVE} was cut or rewritten while this study ran: run it again")

    def add(self, key: str, changes: Iterable[tuple[str, Any]], values: Mapping[str, Any]) -> None:
        """Append the values of a design under a key. `changes` of the base spec make the design.

        When the function returns, the operating system has received the line.
        """
        line = {"key": key, "changes": dict(changes), **values}
        body = json.dumps(line, allow_nan=False).encode("ascii")
        self._starts[key.encode()] = self._write(_line_head(body) + body[1:] + b"\n")

    def _write(self, line: bytes) -> int:
        """Append a line, and return its start position. Another process may have appended lines before."""
        self._stream.seek(0, io.SEEK_END)
        self._stream.write(line)
        self._stream.flush()
        return self._stream.tell() - len(line)


def _line_head(body: bytes) -> bytes:
    """Return the start of an archive line: a hash of its body, in place of the body's opening brace."""
    return b'{"hash": "%s", ' % hashlib.blake2b(body, digest_size=8).hexdigest().encode("ascii")


def _line_body(line: bytes) -> bytes | None:
    """Return the values of a line as JSON, without their hash. None if they do not match the hash."""
    begin, _, rest = line.rstrip(b"\n").partition(b", ")
    body = b"{" + rest
    return body if begin + b", " == _line_head(body) else None
