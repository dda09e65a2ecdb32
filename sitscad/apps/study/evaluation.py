"""What an evaluation says of one design, its figures with what each can be off by and which rules refuse it; and the
evaluations of a study as a file: a line a design, appended and never rewritten, cache, checkpoint and audit at once.
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
"""Verdicts: no rule refuses the design; one does; some could not be decided, and none refuses it."""

FULL, SCREEN = "full", "screen"
"""Levels: what `check` does, without hints; and the quick one, which states the error of each figure."""

UNDRAWN = frozenset({"SIT111", "SIT112", "SIT113", "SIT118", "SIT119"})
"""Rules that find leads missing: what such a design has at its contacts lacks them."""


BROKEN = 0.05
"""What any breach weighs, however near to its limit: two rules are more than one."""


@record
class Breach:
    """How far a design lies beyond what a rule asks: figure and limit (SI, in `unit`), None where the rule has none.
    ``sigma`` is set where the figure keeps its limit by too little: so many sigma of manufacture, where one is asked.
    """

    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    sigma: float | None = None

    @property
    def size(self) -> float:
        """What a search takes it for: `BROKEN`, and the distance from the limit over the larger of both; 1 where the
        rule has no figures. Of what keeps its limit it is what lacks to one sigma.
        """
        if self.measured is None or self.limit is None:
            return 1.0
        far = abs(self.measured - self.limit) * (1.0 if self.sigma is None else 1.0 / max(self.sigma, 1e-9) - 1.0)
        return BROKEN + far / max(abs(self.limit), abs(self.measured), 1e-300)

    def as_json(self) -> list[Any]:
        """Figure, limit, unit and, where there is one, sigma."""
        return [self.measured, self.limit, self.unit, *(() if self.sigma is None else (self.sigma,))]


@record
class Evaluation:
    """One design, evaluated.

    ``values`` are figures by the measure's name, each with what it may be off by (SI); ``absent`` says why a measure
    that was asked for is not among them. ``refused`` are the rules that find an error, each with its largest breach,
    ``warned`` those that warn and find no error; ``unknown`` are rules whose needs the design meets and that could not
    be decided.
    """

    values: Mapping[str, tuple[float, float]]
    absent: Mapping[str, str] = field(default_factory=dict)
    refused: Mapping[str, Breach] = field(default_factory=dict)
    warned: Mapping[str, Breach] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    level: str = FULL

    def __repr__(self) -> str:
        """A line with the verdict, the rules and the first figures."""
        rules = [*self.refused, *(f"{rule} warns" for rule in self.warned)]
        figures = [f"{name} {value:.4g}" for name, (value, _) in self.values.items()]
        return f"<Evaluation {self.verdict}: {', '.join([*rules[:6], *figures[:4]])}{', ...' * (len(figures) > 4)}>"

    @property
    def verdict(self) -> str:
        """`OK`, `FAILS` or `UNKNOWN`. In full the design passes where `check` passes it, whatever was not checked."""
        return FAILS if self.refused else UNKNOWN if self.unknown and self.level != FULL else OK

    @property
    def refused_by(self) -> tuple[str, ...]:
        """The rules that find an error."""
        return tuple(self.refused)

    @property
    def warned_by(self) -> tuple[str, ...]:
        """The rules that warn."""
        return tuple(self.warned)

    def as_json(self) -> dict[str, Any]:
        """Plain values, as `of_json` reads them back."""
        return {
            "level": self.level, "verdict": self.verdict,
            "values": {name: list(pair) for name, pair in self.values.items()}, "absent": dict(self.absent),
            "refused": {rule: one.as_json() for rule, one in self.refused.items()},
            "warned": {rule: one.as_json() for rule, one in self.warned.items()},
            "unknown": list(self.unknown),
        }


def of_json(said: Mapping[str, Any]) -> Evaluation:
    """The evaluation that `Evaluation.as_json` said; raises KeyError, TypeError or ValueError for anything else. What
    many designs have alike is held once.
    """
    values = {intern(name): (_figure(value), _figure(error)) for name, (value, error) in said["values"].items()}
    absent = {intern(name): intern(why) for name, why in said["absent"].items()}
    refused, warned = ({intern(rule): _breach(*one) for rule, one in said[part].items()}
                       for part in ("refused", "warned"))
    unknown = _alike(tuple(map(intern, said["unknown"])))
    level = {FULL: FULL, SCREEN: SCREEN}[said["level"]]
    return Evaluation(values, absent or NONE, refused or NONE, warned or NONE, unknown, level)


def _breach(measured: float | None, limit: float | None, unit: str, *sigma: float) -> Breach:
    for one in (measured, limit, *sigma):
        if one is not None:
            _figure(one)
    return Breach(measured, limit, intern(unit), *sigma)


def _figure(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("no figure is without end")
    return float(value)


@record
class UnitJudged:
    """One unit: whether it keeps all, what it breaks, whether a computation failed, and its figures."""

    is_good: bool
    broken: tuple[str, ...]
    is_computed: bool
    values: Mapping[str, float]

    def as_json(self) -> list[Any]:
        """Plain values, as `unit_of_json` reads them back."""
        return [self.is_good, list(self.broken), self.is_computed, dict(self.values)]


def unit_of_json(said: Sequence[Any]) -> UnitJudged:
    """The unit that `UnitJudged.as_json` said; raises as `of_json` does."""
    is_good, broken, is_computed, values = said
    figures = {intern(name): _figure(value) for name, value in values.items()}
    return UnitJudged(bool(is_good), tuple(map(intern, broken)), bool(is_computed), figures)


NONE: Mapping[str, Any] = {}
"""Stands for all that are empty."""


@cache
def _alike(rules: tuple[str, ...]) -> tuple[str, ...]:
    return rules


ARCHIVE = "archive.jsonl"


class Archive:
    """Evaluations by the keys that `Base.key` gives; of a file where a path is given, else in memory alone.

    Only where each line begins is held, and lines are read again when they are asked for: a hundred thousand take 30 MB
    and not 600. Each line begins with a hash of what follows. A line that its hash does not fit was changed, or torn
    where a process was killed: it is passed by, and `damaged` counts it. A file ends in a whole line before it is
    appended to. Two that append to one file do not disturb each other.
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
            if (body := _body(line)) is not None:
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
        """The evaluation under a key, where it was asked for these measures, too; of others that it has nothing."""
        said = self.said(key)
        if said is None or "values" not in said:
            return None
        asked = {part: {name: said[part][name] for name in measures if name in said[part]}
                 for part in ("values", "absent")}
        is_asked = all(name in asked["values"] or name in asked["absent"] for name in measures)
        return of_json({**said, **asked}) if is_asked else None

    def units(self, key: str) -> list[UnitJudged] | None:
        """The units under a key."""
        said = self.said(key)
        return None if said is None or "units" not in said else list(map(unit_of_json, said["units"]))

    def said(self, key: str) -> Mapping[str, Any] | None:
        """What was kept under a key, as plain values; raises OSError where somebody else has changed the file since."""
        start = self._starts.get(key.encode())
        if start is None:
            return None
        self._stream.seek(start)
        body = _body(self._stream.readline())
        found = {} if body is None else json.loads(body)
        if found.get("key") == key:
            return dict(found)
        raise OSError(f"{ARCHIVE} was cut or rewritten while this study ran: run it again")

    def add(self, key: str, changes: Iterable[tuple[str, Any]], said: Mapping[str, Any]) -> None:
        """Keep plain values; what their line says is on its way to the disk when this returns."""
        line = {"key": key, "changes": dict(changes), **said}
        body = json.dumps(line, allow_nan=False).encode("ascii")
        self._starts[key.encode()] = self._write(_head(body) + body[1:] + b"\n")

    def _write(self, line: bytes) -> int:
        """Append a line; where it begins, behind whatever another process has appended meanwhile."""
        self._stream.seek(0, io.SEEK_END)
        self._stream.write(line)
        self._stream.flush()
        return self._stream.tell() - len(line)


def _head(body: bytes) -> bytes:
    """The begin of a line of an archive: a hash of its body, in place of the body's brace."""
    return b'{"hash": "%s", ' % hashlib.blake2b(body, digest_size=8).hexdigest().encode("ascii")


def _body(line: bytes) -> bytes | None:
    """The plain values of a line as JSON, without their hash. None if the hash does not fit them."""
    begin, _, rest = line.rstrip(b"\n").partition(b", ")
    body = b"{" + rest
    return body if begin + b", " == _head(body) else None
