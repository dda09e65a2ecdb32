"""What a search for hints may cost: counted in units of work, not timed, so that every machine finds the same hints.

A unit is about a millisecond of a processor of 2020. What laying out and
estimating a design costs is foretold from its numbers, by formulas that were fitted to the times of random designs
(tests/benchmarks/check_times.py) and need to be right within a factor of two only.
"""

from __future__ import annotations

from sitscad.spec.coil import CoilSpec
from sitscad.spec.sensor import SensorSpec

HINTS = ("none", "decisive", "full")
"""What is searched for hints: nothing, what one more check costs (on the errors first), everything."""

DECISIVE = "decisive"

LEAST, MOST, WHOLE = 600.0, 1000.0, 4000.0
"""Units for hints: at least, at most, and together with the check itself at most."""

AFTER_ERRORS, LARGE = 150.0, 2000.0
"""Units for the hints of warnings of a design that is refused, for its errors come first and mending them changes it,
where its check takes more than so many without hints."""

LOOKS = 1000.0
"""Units for looking at what was not tried any more, before it is named: at its layout, and by rules that need no
estimate.
"""

FULL = 400_000.0
"""Units of the long search: minutes."""

TRIALS_OF_ONE_CHANGE = 10_000
"""No changed board is routed for more trials than these: the next change may be easier."""

TURN, PAIR = {True: 2.0, False: 8.0}, {True: 0.1, False: 0.05}
"""Units that a turn costs the estimate, and a pair of turns: of round coils, and of coils of sides and arcs."""

SOLVING = 150.0
"""Units that solving the target takes, where a share of an endless one's effect is not enough."""

MAGNETIC, POOR, SMALL, LONG_FROM = 1.5, 5e6, 0.8, 1.05
"""Relative permeability from which and conductivity (S/m) up to which it likely is, its side over the coil's smaller
one, and how long a coil is over its width."""

LONG = 2.5
"""Coils longer than wide have fewer figures that repeat: so many times that."""


def winding_work(spec: SensorSpec) -> float:
    """Units that winding the coils takes, their inner vias included."""
    return 10.0 + 8.0 * len(spec.coil.layers) ** 2


def layout_work(spec: SensorSpec) -> float:
    """Units that laying a board out takes where its leads find their ways at once."""
    return winding_work(spec) + 40.0 * len(spec.array.placements)


def trial_work(spec: SensorSpec) -> float:
    """Units that one trial of a branch takes the router: more where more turns are in its way."""
    return 0.3 + 0.005 * sum(spec.coil.layer_turns)


def estimate_work(spec: SensorSpec, is_same_board: bool = False, is_solved: bool = False) -> float:
    """Units that an estimate takes; less of a board that was estimated before, only with other things around it; more
    where the target `is_solved` in a design like it.
    """
    solved = spec.target is not None and (is_solved or _is_solved(spec))
    around = 100.0 + (100.0 if spec.target is not None else 0.0) + (SOLVING if solved else 0.0)
    return around if is_same_board else around + _solving(spec.coil, len(spec.array.placements))


def _is_solved(spec: SensorSpec) -> bool:
    """Whether the target is likely solved for its own size: no good conductor, smaller than a coil, or over long coils
    that it does not cover.
    """
    target, (long, short) = spec.target, sorted(spec.coil.size, reverse=True)
    if target is None:
        return False
    metal = target.material
    is_poor = metal.relative_permeability > MAGNETIC or metal.conductivity < POOR
    return is_poor or min(target.size) < SMALL * short or (long > LONG_FROM * short and max(target.size) < long)


def _solving(coil: CoilSpec, coils: int) -> float:
    turns = sum(coil.layer_turns)
    alone = TURN[coil.outline.is_round] * turns + PAIR[coil.outline.is_round] * turns**2
    return (LONG if coil.size[0] != coil.size[1] else 1.0) * alone * (1.0 + 0.3 * (coils - 1))


def check_work(spec: SensorSpec) -> float:
    """Units that a check takes without hints."""
    return layout_work(spec) + estimate_work(spec)


class Budget:
    """How many units of work the search for hints may still take."""

    def __init__(self, units: float) -> None:
        self.left = units

    @classmethod
    def of(cls, hints: str, spec: SensorSpec, is_checked: bool = True) -> Budget:
        """The budget of a choice of HINTS: by default as much as the check of the design itself takes, for both
        together have to be quick, and twice that where it was not checked. Raises ValueError for any other choice.
        """
        if hints not in HINTS:
            raise ValueError(f"hints are one of {', '.join(HINTS)}, not {hints!r}")
        if hints != DECISIVE:
            return cls(0.0 if hints == "none" else FULL)
        work = check_work(spec)
        return cls(max(LEAST, min(work, MOST, WHOLE - work)) + (0.0 if is_checked else min(work, MOST)))

    def spend(self, units: float) -> bool:
        """Take so many units; False, and nothing is taken, where fewer are left."""
        if units > self.left:
            return False
        self.left -= units
        return True

    def after_errors(self, spec: SensorSpec) -> Budget:
        """What is left of it for the warnings of a design that is refused."""
        return self if self.is_long or check_work(spec) <= LARGE else Budget(min(self.left, AFTER_ERRORS))

    def for_warnings(self) -> Budget:
        """What is left of it where nothing was refused: a design that passes is not to be held up long."""
        return self if self.is_long else Budget(min(self.left, LEAST))

    @property
    def is_long(self) -> bool:
        """Whether much may be tried: alternatives are looked for, too."""
        return self.left > WHOLE
