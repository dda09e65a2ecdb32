"""Results of a check besides its findings: the coils' signals, requirements, the fit in the jaw, the jaws' closing.

The module holds values only. If a package has not changed, they are read from it, and the code that computes them is
not loaded.
"""

from __future__ import annotations

import math

from sitscad.basics.record import record


@record
class Signal:
    """Signal of a coil: its change from rest to pressed by `force` (N).

    Attributes
    ----------
    rest : float
        inductance at the contacts, at rest (H)
    per_newton, sigma : float
        change of inductance per newton, and its standard deviation (H/N); sigma is None if it is unknown
    frequency_per_newton, frequency_sigma : float
        change of frequency per newton, and its standard deviation (Hz/N); sigma is None if it is unknown
    share : float
        relative change, over the whole force, of the inductance that the converter's formula gives
    frequency_share : float
        relative change of the frequency over the whole force
    steps : float or None
        this change in steps of the converter
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
        """Relative change of the inductance over the whole force, without the effect of changed losses."""
        return self.per_newton * self.force / self.rest

    @property
    def has_loss_in_it(self) -> bool:
        """Whether changed losses make up much of the signal, or reverse its sign. Losses lower the tank's frequency."""
        shares_of = self.share, self.by_inductance
        return abs(shares_of[0] - shares_of[1]) > BY_LOSS * max(map(abs, shares_of))


BY_LOSS = 0.2
"""Least relative difference, between the signal and the signal due to inductance alone, that is reported.

Changed losses cause the difference. It is 0.01 to 0.04 under copper and aluminium. Under steel it is 0.2 and more, up
to a change of sign (derived: the templates, with such targets).
"""


@record
class RequirementResult:
    """An estimated value beside the limit that the spec requires.

    ``requirement`` is the key in `requirements`, and ``rule`` is the rule that compares them. ``measured`` is the
    largest value over all axes and loads. It is on axis ``axis`` at load ``at``. ``limit`` is None if nothing is
    required. ``unit`` is ``N``, ``N m``, or empty for fractions.
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
    """A part's contribution to a `Measure`: its size (m), half its tolerance band (m), and the tolerance's source."""

    part: str
    nominal: float
    tolerance: float
    source: str


@record
class Measure:
    """A size with an upper limit (m): nominal, with the root-sum-square of all tolerances, and in the worst case.

    ``decided_by`` is the part that determines the size, and ``parts`` are the contributions of all parts.
    ``assumption`` states the assumption behind the values, empty if there is none.
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
        """Room that remains (m) in the worst case. Negative if the size exceeds its limit."""
        return self.limit - self.worst

    @property
    def measured(self) -> float:
        """Size (m) to compare with the limit.

        If the larger of the nominal and the root-sum-square size exceeds the limit, this size is returned. Otherwise it
        is the worst case.
        """
        likely = max(self.nominal, self.root_sum_square)
        return likely if likely > self.limit else self.worst

    @property
    def likely_margin(self) -> float:
        """Room that remains (m) with the root-sum-square of all tolerances."""
        return self.limit - self.root_sum_square


@record
class Closing:
    """A pair of jaws that turn by equal angles about one pivot, in relation to grasped tissue.

    ``parallel_at`` is the tissue thickness (m) at which the faces are parallel. Negative if the sensor is too thick for
    parallel faces. ``reach`` is the distance from the pivot to the sensor's middle (m), or None if the jaw's hinge is
    unknown. ``opening`` is the angle (rad) between the faces of the wide open jaws. ``offset`` is the lateral distance
    of the pivot from the middle (m).
    """

    parallel_at: float
    reach: float | None
    opening: float | None
    offset: float = 0.0

    def tilt(self, thickness: float) -> float | None:
        """Return the angle (rad) between the faces on tissue of a thickness (m) at the sensor's middle.

        Positive if the jaws are open towards the tip, so that the heel touches first. None if the hinge is unknown, or
        if the tissue is too thick.

        Notes
        -----
        Each face turns about the pivot by half the angle, at a distance of half of `parallel_at`. The gap is 2 reach
        sin(tilt/2) + parallel_at cos(tilt/2), a single sine whose amplitude is the hypotenuse of both factors. The
        pivot's `offset` does not change the gap, because both faces turn about the same point.
        """
        if self.reach is None:
            return None
        amplitude, lag = math.hypot(2.0 * self.reach, self.parallel_at), math.atan2(self.parallel_at, 2.0 * self.reach)
        sine = thickness / amplitude
        return 2.0 * (math.asin(sine) - lag) if abs(sine) <= 1.0 else None

    def slide(self, thickness: float) -> float | None:
        """Return the distance (m) that the faces still slide along each other until they are parallel.

        `thickness` (m) is the thickness of the tissue between the faces. The result is twice the pivot's offset times
        the sine of half the angle between the faces. Positive if this jaw's face moves towards the tip while closing.
        """
        tilt = self.tilt(thickness)
        return None if tilt is None else 2.0 * self.offset * math.sin(tilt / 2.0)

    @property
    def most(self) -> float | None:
        """Thickness (m) of the thickest tissue that fits between the wide open faces at the sensor's middle.

        None if the hinge is unknown.
        """
        if self.reach is None or self.opening is None:
            return None
        half = self.opening / 2.0
        return self.parallel_at * math.cos(half) + 2.0 * self.reach * math.sin(half)
