"""How far manufacture scatters the states' numbers: what is stated, over what units do that are worked out anew.

`python tests/validation/scatter_of_units.py [TEMPLATES]` prints, for every state of the first coil, one sigma of L, R,
R_P and frequency as the estimate states it over that of whole designs. Each cause of scatter is moved by itself, to
three Gauss points of its distribution, and the variances add up: what two causes do together beyond that is left out.
What is stated for errors of the model is left out, too.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import sitscad
from sitscad import Design
from sitscad.estimates.scatter import CAUSES
from sitscad.estimates.states.pressing import BLOCK, PART
from sitscad.estimates.uncertainty import SHARE, WINDOW
from sitscad.layout.as_made import as_made

TEMPLATES = Path(__file__).parents[2] / "templates"
NUMBERS = ("inductance", "resistance", "parallel_resistance", "frequency")
OF_MODEL = (SHARE, WINDOW, PART, BLOCK)
AT = {"inductance": 0, "frequency": 1, "resistance": 2, "parallel_resistance": 3}
"""Where a number stands in `Spread.shifts`."""

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
    found: dict[str, dict[str, np.ndarray]] = {}
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
            found.setdefault(state, {})[cause.name] = deviation
    return found


def stated(design, state: str) -> np.ndarray:
    """One sigma of each number (4,) as an estimate states it, what is for errors of the model left out."""
    spread = design.estimates.coils[0].states[state].spread
    whole = np.array([getattr(spread, number) for number in NUMBERS])
    of_model = [[spread.shifts[one][AT[number]] for number in NUMBERS] for one in OF_MODEL if one in spread.shifts]
    return np.sqrt(whole**2 - np.sum(np.square(np.reshape(of_model, (-1, 4))), axis=0))


def ratios(name) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """State, stated sigmas over true ones, and true ones relative to their numbers, of a template."""
    design = drawn(name)
    nominal = _numbers(design)
    for state, causes in by_causes(design).items():
        true = np.sqrt(np.sum(np.square(list(causes.values())), axis=0))
        yield state, stated(design, state) / true, true / nominal[state]


def main() -> None:
    """Print a row for every template and state."""
    print("| template | state | L | R | R_P | f |\n| --- | --- | --- | --- | --- | --- |")
    for name in sys.argv[1:] or sorted(path.stem for path in TEMPLATES.glob("*.yaml")):
        for state, over, true in ratios(name):
            row = (f"{ratio:.2f} (of {100.0 * part:.2f} %)" for ratio, part in zip(over, true, strict=True))
            print(f"| `{name}` | {state} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
