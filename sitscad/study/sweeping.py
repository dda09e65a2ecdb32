"""Sweeps: every design of a product of ranges, evaluated, as a table of arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from sitscad.arrays import Array
from sitscad.record import record
from sitscad.spec.format.reading import SpecError
from sitscad.spec.load import plain
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import plain_value
from sitscad.study.changes import Base, Changes
from sitscad.study.evaluating import Executor, Workers
from sitscad.study.evaluation import FULL, SCREEN, Evaluation
from sitscad.study.full import figures, judged
from sitscad.study.measures import MEASURES, measures_named
from sitscad.study.screen import screened
from sitscad.study.space import RangeError, counted

Progress = Callable[[int, int], None]

MOST_DESIGNS = 1_000_000
"""Designs of one sweep."""


@record(eq=False)
class SweepTable:
    """A row a design, the last key fastest.

    ``keys`` hold the values of every varied key as a spec has them; ``values`` and ``errors`` (by measure; rows) are
    the figures and what each may be off by, in the measure's unit, NaN where a design has none; ``verdict``,
    ``refused_by`` and ``warned_by`` what the rules say.
    """

    spec: str
    level: str
    keys: Mapping[str, tuple[Any, ...]]
    values: Mapping[str, Array]
    errors: Mapping[str, Array]
    verdict: tuple[str, ...]
    refused_by: tuple[tuple[str, ...], ...]
    warned_by: tuple[tuple[str, ...], ...]
    shape: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.verdict)


def measure(
    spec: SensorSpec, level: str = SCREEN, measures: Sequence[str] | None = None
) -> Evaluation:
    """Figures of one design, each with what it may be off by, and what the rules say of it; all of the level's where no
    `measures` are named. Raises ValueError for a level or a measure that there is not.
    """
    names = _measures_of(level, measures)
    return judged(spec, names) if level == FULL else screened([spec], names)[0]


def sweep(
    spec: SensorSpec,
    ranges: Mapping[str, Sequence[Any]],
    measures: Sequence[str] | None = None,
    *,
    level: str = SCREEN,
    jobs: int | None = 1,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SweepTable:
    """Every design of the product of `ranges`: keys and values as in `SensorSpec.replace`, the last key fastest.

    A design that a rule of the spec itself refuses has no figures and names that rule. `jobs` are processes, `executor`
    is whatever else has `submit`. Raises ValueError for a level or measure that there is not, no range, an empty one or
    too many designs; SpecError for a key that the spec does not have.
    """
    names = _measures_of(level, measures)
    axes = {str(key): tuple(plain(list(values))) for key, values in ranges.items()}
    if not axes or not all(axes.values()):
        raise ValueError("a sweep takes at least one key, and at least one value of each")
    shape = tuple(map(len, axes.values()))
    if (total := int(np.prod(np.array(shape, dtype=object)))) > MOST_DESIGNS:
        raise ValueError(f"{total} designs; {MOST_DESIGNS} are the most of one sweep")
    base = Base.of(spec)
    for key, values in axes.items():
        require_key(base, key, values)
    designs: list[Changes] = [tuple(zip(axes, point, strict=True)) for point in product(*axes.values())]
    found = []
    with Workers(base, jobs, executor) as workers:
        for one in workers.evaluations(designs, names, level):
            found.append(one)
            if progress is not None:
                progress(len(found), total)
    return _table(base.path, level, axes, shape, names, found)


def require_key(base: Base, key: str, values: Sequence[Any]) -> None:
    """Raise the `SpecError` of a key that the spec has not, or of a value that can be none of its. Values that do not
    fit others refuse single designs, and not a sweep.
    """
    looked_at = values if len(values) <= MANY_VALUES else (values[0], values[-1])
    for value in looked_at:
        try:
            base.design(((key, value),))
        except SpecError as error:
            if any(one.rule in UNFIT for one in error.findings):
                raise


MANY_VALUES = 100
"""Values of a key from which on only its ends are read before anything is computed."""

UNFIT = ("SIT002", "SIT004", "SIT005", "SIT006", "SIT007")
"""Rules of the spec that say that a key is none, or that a value can be none of its: no other key changes that."""


def _measures_of(level: str, measures: Sequence[str] | None) -> tuple[str, ...]:
    if level not in (SCREEN, FULL):
        raise ValueError(f"the level is {SCREEN} or {FULL}, not {level!r}")
    names = measures_named(measures if measures is None else tuple(measures), level)
    lacking = [name for name in names if level not in MEASURES[name].levels]
    if lacking:
        raise ValueError(f"{', '.join(lacking)}: only the level {FULL} has it")
    return names


def _table(
    path: str, level: str, axes: Mapping[str, tuple[Any, ...]], shape: tuple[int, ...], names: Sequence[str],
    found: Sequence[Evaluation],
) -> SweepTable:
    points = list(product(*axes.values()))
    columns = {key: tuple(point[k] for point in points) for k, key in enumerate(axes)}
    nothing = (np.nan, np.nan)
    pairs = {name: np.array([one.values.get(name, nothing) for one in found]) for name in names}
    return SweepTable(
        path, level, columns, {name: pair[:, 0] for name, pair in pairs.items()},
        {name: pair[:, 1] for name, pair in pairs.items()}, tuple(one.verdict for one in found),
        tuple(one.refused_by for one in found), tuple(one.warned_by for one in found), shape,
    )


def range_of(text: str) -> tuple[str, tuple[Any, ...]]:
    """The key and the values of ``coil.turns=6:12:13`` or ``coil.layers=2,4``; raises `RangeError`."""
    key, equals, written = text.partition("=")
    if not equals or not key.strip() or not written.strip():
        raise RangeError(f"{text!r} is no KEY=FIRST:LAST:COUNT and no KEY=VALUE,VALUE", "like coil.turns=6:12:13")
    parts = written.split(":")
    if len(parts) == 1:
        return key.strip(), tuple(plain_value(value.strip()) for value in written.split(","))
    if len(parts) != 3 or not parts[2].strip().isdecimal() or len(parts[2].strip()) > 9:
        raise RangeError(f"{text!r}: FIRST:LAST:COUNT is wanted", "like 6:12:13 or 70um:110um:9")
    return key.strip(), counted(parts[0].strip(), parts[1].strip(), int(parts[2]))


__all__ = ["SweepTable", "figures", "measure", "range_of", "require_key", "sweep"]
