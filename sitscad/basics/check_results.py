"""What a check measures of a design beside its findings: each coil's signal, what it feels of what is asked, the fit in
the jaw, and how that closes.

Values alone, without what works them out: a package that has not changed reads them back and loads nothing else.
"""

from __future__ import annotations

import math

from sitscad.basics.record import record


@record
class Signal:
    """One coil from rest to pressed by `force` (N): inductance at its contacts at rest (H), that and the frequency per
    newton (H/N, Hz/N) with one sigma of each (None: unknown); the share by which the converter's reading changes over
    the whole force, of inductance by its formula and of frequency, and the steps of the converter in that.
    """

    coil: str
    force: float
    rest: float
    per_newton: float
    sigma: float | None
    frequency_per_newton: float
    frequency_sigma: float | None
    share: float
    frequency_share: float
    steps: float | None

    @property
    def by_inductance(self) -> float:
        """The share by which the inductance itself changes: what the reading would do if losses stayed."""
        return self.per_newton * self.force / self.rest

    @property
    def has_loss_in_it(self) -> bool:
        """Whether losses, which lower the tank's frequency, make a good part of the reading's change, or turn it."""
        both = self.share, self.by_inductance
        return abs(both[0] - both[1]) > BY_LOSS * max(map(abs, both))


BY_LOSS = 0.2
"""Part of a signal from which on it is told that losses make it: under copper and aluminium it is 0.01 to 0.04, under
steel 0.2 and more up to a change of sign (derived: the templates, with such targets)."""


@record
class RequirementResult:
    """What is felt beside what `requirements` ask: the requirement's name, the rule that judges it, the largest figure
    of all axes and loads, what is asked (None: nothing), both in `unit` (``N``, ``N m``, or empty for shares), on which
    axis and where.
    """

    requirement: str
    rule: str
    measured: float
    limit: float | None
    unit: str
    axis: str
    at: str


@record
class Share:
    """What a part brings to a measure: its size and half its band (m), and where the tolerance comes from."""

    part: str
    nominal: float
    tolerance: float
    source: str


@record
class Measure:
    """One size that has to stay below a limit (m): nominal, by root-sum-square of all tolerances, and at worst.

    ``decided_by`` is the part that decides it, ``parts`` what it is made of, ``assumption`` what the figures take for
    granted in words (empty: nothing).
    """

    name: str
    nominal: float
    root_sum_square: float
    worst: float
    limit: float
    decided_by: str
    parts: tuple[Share, ...]
    assumption: str = ""

    @property
    def margin(self) -> float:
        """What is to spare (m) at worst; negative where it is too much."""
        return self.limit - self.worst

    @property
    def measured(self) -> float:
        """What is held against the limit (m): root-sum-square or nominal where that is beyond it, else the worst."""
        likely = max(self.nominal, self.root_sum_square)
        return likely if likely > self.limit else self.worst

    @property
    def likely_margin(self) -> float:
        """What is to spare (m) by root-sum-square."""
        return self.limit - self.root_sum_square


@record
class Closing:
    """A pair of jaws that turn by equal angles about one pivot, as grasped tissue sees them.

    ``parallel_at`` is the grasped thickness (m) at which the faces are parallel, negative where the sensor is too thick
    for that; ``reach`` is from the pivot to the sensor's middle (m), None where the jaw's hinge is not known;
    ``opening`` the angle (rad) between the faces, wide open; ``offset`` how far the pivot lies beside the middle.
    """

    parallel_at: float
    reach: float | None
    opening: float | None
    offset: float = 0.0

    def tilt(self, thickness: float) -> float | None:
        """The angle (rad) between the faces on tissue of a thickness (m) at the sensor's middle: positive where the
        jaws stand open towards the tip, so that it touches at the heel first. None without a hinge.

        Each face goes round the pivot by half the angle, half of `parallel_at` beside it: the gap is 2 reach
        sin(tilt/2) + parallel_at cos(tilt/2), a single sine whose amplitude is the hypotenuse of both factors. A pivot
        beside the middle changes nothing of it, because both faces turn about the same point.
        """
        if self.reach is None:
            return None
        amplitude, lag = math.hypot(2.0 * self.reach, self.parallel_at), math.atan2(self.parallel_at, 2.0 * self.reach)
        sine = thickness / amplitude
        return 2.0 * (math.asin(sine) - lag) if abs(sine) <= 1.0 else None

    def slide(self, thickness: float) -> float | None:
        """How far (m) the faces have still to slide along each other, from this thickness of tissue until they are
        parallel: twice the pivot's offset times the sine of half the angle between them. Positive where this jaw's face
        moves towards the tip while closing.
        """
        tilt = self.tilt(thickness)
        return None if tilt is None else 2.0 * self.offset * math.sin(tilt / 2.0)

    @property
    def most(self) -> float | None:
        """The thickest tissue (m) that goes between the faces at the sensor's middle, wide open; None if not known."""
        if self.reach is None or self.opening is None:
            return None
        half = self.opening / 2.0
        return self.parallel_at * math.cos(half) + 2.0 * self.reach * math.sin(half)
