"""How far manufacture scatters the states' numbers: what is stated, over what units do that are worked out anew.

`python tests/validation/scatter_of_units.py [--causes] [TEMPLATES]` prints, for every state of the first coil, one
sigma of L, R, R_P and frequency as the estimate states it over that of whole designs. Each cause of scatter is moved by
itself, to three Gauss points of its distribution, and the variances add up: what two causes do together beyond that is
left out. What is stated for errors of the model is left out, too. With `--causes` a row for each cause follows: what is
stated over what whole designs do, in per cent of the number.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import sitscad
from sitscad import Design
from sitscad.estimates.tolerances.scatter import CAUSES, FOIL, PLATING, THICKNESS
from sitscad.estimates.tolerances.units_made import as_made

TEMPLATES = Path(__file__).parents[2] / "templates"
NUMBERS = ("inductance", "resistance", "parallel_resistance", "frequency")
AT = {"inductance": 0, "frequency": 1, "resistance": 2, "parallel_resistance": 3}
"""Where a number stands in `StateSigmas.shifts`."""

EVEN = math.sqrt(1.8), (5 / 18, 8 / 18, 5 / 18)
NORMAL = math.sqrt(3.0), (1 / 6, 2 / 3, 1 / 6)
"""Gauss points of an evenly filled band and of a normal distribution: how many sigmas aside, and their weights."""


def _numbers(design):
    """The numbers of all states of the first coil, by state."""
    states = design.estimates.coils[0].states
    return {name: np.array([getattr(state, number) for number in NUMBERS]) for name, state in states.items()}


def drawn(name):
    """A template's design with its capacitor chosen: the part that is soldered to every unit."""
    design = Design(sitscad.load(TEMPLATES / f"{name}.yaml"))
    spec = replace(design.spec, readout=replace(design.spec.readout,
                                                capacitance=design.estimates.readout.capacitance))
    return Design(spec, replace(design.layout, spec=spec))


def by_causes(design, causes: Sequence[str] | None = None) -> dict[str, dict[str, np.ndarray]]:
    """One sigma of each number (4,) by state and cause, of units as whole designs."""
    result: dict[str, dict[str, np.ndarray]] = {}
    middle = _numbers(design)
    for cause in CAUSES:
        sigma = cause.sigma(design.spec)
        if cause.moved is None or not sigma or (causes is not None and cause.name not in causes):
            continue
        aside, weights = NORMAL if cause.is_logarithmic else EVEN
        specs = [cause.moved(design.spec, way * aside * sigma) for way in (-1.0, 1.0)]
        less, more = (_numbers(Design(spec, as_made(design.layout, spec))) for spec in specs)
        for state in middle.keys() & less.keys() & more.keys():
            rows = np.array([less[state], middle[state], more[state]])
            deviation = np.sqrt(np.array(weights) @ (rows - np.array(weights) @ rows) ** 2)
            result.setdefault(state, {})[cause.name] = deviation
    return result


def stated(design, state: str, causes: Iterable[str]) -> np.ndarray:
    """One sigma of each number (4,) by some causes, as an estimate states it."""
    spread = design.estimates.coils[0].states[state].spread
    named = {THICKNESS if item in (FOIL, PLATING) else item for item in causes}
    whole = np.array([getattr(spread, number) for number in NUMBERS])
    others = [_shift(spread, item) for item in spread.shifts if item not in named]
    return np.sqrt(whole**2 - np.sum(np.square(np.reshape(others, (-1, 4))), axis=0))


def _shift(spread, cause: str) -> np.ndarray:
    """What one sigma of a cause does to each number (4,) as an estimate states it."""
    return np.array([spread.shifts[cause][AT[number]] for number in NUMBERS])


def of_each(design, state: str, causes: Mapping[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Cause, and what one sigma of it does to each number (4,): stated, and of whole designs; foil and plating as one.
    """
    spread = design.estimates.coils[0].states[state].spread
    copper = [true for cause, true in causes.items() if cause in (FOIL, PLATING)]
    merged = {cause: true for cause, true in causes.items() if cause not in (FOIL, PLATING)}
    if copper:
        merged[THICKNESS] = np.sqrt(np.sum(np.square(copper), axis=0))
    for cause, true in merged.items():
        yield cause, np.abs(_shift(spread, cause)) if cause in spread.shifts else 0.0 * true, true


def main() -> None:
    """Print a row for every template and state."""
    chosen = [name for name in sys.argv[1:] if name != "--causes"]
    print("| template | state | L | R | R_P | f |\n| --- | --- | --- | --- | --- | --- |")
    for name in chosen or sorted(path.stem for path in TEMPLATES.glob("*.yaml")):
        design = drawn(name)
        nominal = _numbers(design)
        for state, causes in by_causes(design).items():
            true = np.sqrt(np.sum(np.square(list(causes.values())), axis=0))
            part, over = true / nominal[state], stated(design, state, causes) / true
            print(f"| `{name}` | {state} | {_row(over, '{:.2f}', part, ' (of {:.2f} %)')} |", flush=True)
            for cause, message, real in of_each(design, state, causes) if "--causes" in sys.argv else ():
                cells = _row(100.0 * message / nominal[state], "{:.3f}", real / nominal[state], "/{:.3f}")
                print(f"|  | {cause} | {cells} |", flush=True)


def _row(first: np.ndarray, form: str, part: np.ndarray, other: str) -> str:
    """Cells of a row: a figure, and beside it a part in per cent."""
    return " | ".join(form.format(a) + other.format(100.0 * b) for a, b in zip(first, part, strict=True))


if __name__ == "__main__":
    main()
