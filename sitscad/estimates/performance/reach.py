"""How far every axis goes, and what ends it first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.performance.bench import Bench, Solved
from sitscad.estimates.performance.values import AXES
from sitscad.estimates.response.pad import TOO_SOFT, pushed
from sitscad.estimates.response.values import Response
from sitscad.record import record

Array = NDArray[np.float64]

STEPS = 9
"""Loads along an axis that are looked at."""


INSTABILITY = "instability"
"""What ends an axis where no shape of the pad bears the load: it gives way sideways."""


@record(eq=False)
class Course:
    """Loads (n, 3; N) along one axis from a working point, the response there, and up to where it may go."""

    loads: Array
    response: Response
    range: float
    limited_by: str


def course(bench: Bench, solved: Solved, load: Array, name: str) -> Course:
    """The course of one axis: the normal one from nothing, shear along + on top of the working point's load."""
    column, most = AXES.index(name), bench.farthest[name]
    loads = np.tile(load, (STEPS, 1))
    loads[:, column] = np.linspace(0.0, most, STEPS)
    poses, said = pushed(bench.spec, loads, np.ones(STEPS, dtype=bool))
    found = solved.respond(poses)
    wrong = _wrong(bench, found) | {INSTABILITY: np.array([note == TOO_SOFT for note in said])}
    firsts = {cause: int(np.argmax(bad)) for cause, bad in wrong.items() if bad.any()}
    if not firsts:
        return Course(loads, found, most, "strain")
    cause = min(firsts, key=lambda one: firsts[one])
    return Course(loads, found, float(loads[max(firsts[cause] - 1, 0), column]), cause)


def _wrong(bench: Bench, found: Response) -> dict[str, NDArray[np.bool_]]:
    """By cause, the points at which the axis has ended."""
    converter = bench.spec.readout.device
    least, most = converter.limit("amplitude_stable_min"), converter.limit("amplitude_max")
    return {
        "converter": np.any(~(found.frequency < converter.limit("sensor_frequency_max")), axis=1),
        "amplitude": np.any(~(found.amplitude > least) | (found.amplitude > most), axis=1),
        "contact": np.array([any("contact" in note for note in notes) for notes in found.notes]),
    }
