"""The states of an estimate against the response at their poses: random designs of seven metals, targets of all sizes.

    python tests/validation/states_of_response.py [-n 60] [--first 1] [--shares]

Designs are those of `tests/benchmarks/check_times.py`, six of ten with another metal, size or thickness of the target,
three of ten with a shield. Prints for every one how far its states are off the response, and what part that is of what
they state: the target's change of L (of the larger of it and 1 % of L), R, and what a newton changes of the frequency.
With `--shares` no target is solved: what shares of an endless sheet's effect say everywhere.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sitscad import Design, SensorSpec, SpecError
from sitscad.basics.record import record
from sitscad.estimates import estimate_layout
from sitscad.estimates.loads.pad import NoResponse

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import check_times

METALS = ("copper", "aluminium", "brass", "stainless-304", "stainless-17-4ph", "ferrite", "titanium-grade-5")
MOST_TURNS = 80


def varied(seed: int) -> Design | None:
    """A random design with a target; None where this one has none, is too long a winding, or does not go together."""
    document, pick = check_times.design(seed), random.Random(10_000 + seed)
    target, coil = document.get("target"), document["coil"]
    if not isinstance(target, dict) or coil["turns"] * coil["layers"] > MOST_TURNS:
        return None
    if pick.random() < 0.6:
        share = pick.choice([0.3, 0.5, 0.7, 1.0, 1.0, 1.3])
        sides = [round(share * side, 2) for side in np.atleast_1d(target["size"])]
        more = {"material": pick.choice(METALS), "thickness": pick.choice([0.05, 0.1, 0.2, 0.5])}
        document["target"] = {**target, **more, "size": sides if len(sides) > 1 else sides[0]}
    if pick.random() < 0.3:
        metal = pick.choice(["copper", "ferrite", "stainless-17-4ph"])
        document["shield"] = {"material": metal, "thickness": 0.1, "gap": 0.3}
    try:
        return Design(SensorSpec.from_mapping(document))
    except SpecError:
        return None


@record
class Apart:
    """How far a coil's state is off the response: the target's change of L, of the larger of it and 1 % of L; L and R
    relative; and what part of what is stated.
    """

    state: str
    change: float
    inductance: float
    resistance: float
    of_stated_change: float
    of_stated_resistance: float


def apart(design: Design) -> Iterator[Apart]:
    """Every state of every coil that has a target over it."""
    estimates = design.estimates
    poses = {s.name: (0.0, 0.0, s.pose.z, 0.0, 0.0, 0.0) for s in estimates.states if s.pose is not None}
    result = design.response.respond(np.array(list(poses.values())))
    for number, name in enumerate(poses):
        for k, coil in enumerate(estimates.coils):
            if name not in coil.states or coil.states[name].target_change is None:
                continue
            state, text = coil.states[name], result.target_change[number, k, k]
            least = max(abs(text), 0.01 * coil.winding_inductance)
            change, lossy = (
                abs(state.target_change - text) / least,
                result.resistance[number, k] / state.resistance - 1.0,
            )
            yield Apart(name, change, abs(result.inductance[number, k] / state.inductance - 1.0), abs(lossy),
                        change / (state.target_change_error + result.target_change_error[number, k, k]),
                        abs(lossy) / state.resistance_error)


def slopes(design: Design) -> tuple[np.ndarray, np.ndarray]:
    """What a newton changes of the coils' frequencies (Hz) from rest to pressed: by states, and by the response."""
    force = design.estimates.normal_force
    result = design.response.respond_to_loads(np.array([[0.0, 0.0, 0.0], [force, 0.0, 0.0]])).frequency
    text = [coil.sensitivity(force)[1] for coil in design.estimates.coils]
    return np.array(text), (result[1] - result[0]) / force


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, default=60)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--shares", action="store_true")
    chosen, whole = parser.parse_args(), {True: [], False: []}
    for seed in range(chosen.first, chosen.first + chosen.n):
        design = varied(seed)
        if design is None:
            continue
        if chosen.shares:
            design = Design(design.spec, design.layout, estimate_layout(design.layout, is_solved=False))
        try:
            result = list(apart(design))
        except NoResponse:
            continue
        if result:
            worst = [max(getattr(item, name) for item in result) for name in FIGURES]
            whole[design.estimates.is_solved].append(worst)
            how = "solved" if design.estimates.is_solved else "shares"
            print(seed, how, design.spec.target.material.name, design.spec.coil.shape, _row(worst), flush=True)
    for is_solved, rows in whole.items():
        if rows:
            how = "solved" if is_solved else "by shares"
            print(
                f"{how}, {len(rows)}: worst {_row(np.max(rows, axis=0))}; 95 % {_row(np.percentile(rows, 95, axis=0))}"
            )


FIGURES = ("change", "inductance", "resistance", "of_stated_change", "of_stated_resistance")


def _row(values: list[float] | np.ndarray) -> str:
    change, inductance, resistance, of_change, of_resistance = values
    return (f"change {100.0 * change:.2f} %, L {100.0 * inductance:.2f} %, R {100.0 * resistance:.2f} %, "
            f"of what is stated {of_change:.2f} and {of_resistance:.2f}")


if __name__ == "__main__":
    main()
