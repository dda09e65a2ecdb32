"""Delivered items and their tests: the panel, its coupon, and bare boards on the bench at 20 degrees Celsius."""

from __future__ import annotations

from functools import cached_property

from sitscad.basics.record import memo, record, replace
from sitscad.estimates import Estimates, estimated
from sitscad.estimates.design import ROOM_TEMPERATURE, Design, at_room_temperature
from sitscad.estimates.states.steps import metered
from sitscad.layout.panel import Panel, plan


@record(eq=False)
class Incoming:
    """Panel, bench estimates and coupon of a design; each is computed on first use and cached."""

    design: Design

    @cached_property
    def panel(self) -> Panel | None:
        """Panel in which the boards are ordered; None if they are ordered singly."""
        return plan(self.design.layout)

    @cached_property
    def board(self) -> Estimates:
        """Electrical estimates at 20 degrees Celsius, the boards' test temperature, with an LCR meter's readings."""
        estimates = at_room_temperature(self.design).estimates
        return replace(estimates, metered=metered(self.design.layout, ROOM_TEMPERATURE))

    @cached_property
    def coupon(self) -> Estimates | None:
        """Electrical estimate of the panel's coupon in free air; None if there is no coupon."""
        if self.panel is None or self.panel.coupon is None:
            return None
        return estimated(self.panel.coupon, temperature=ROOM_TEMPERATURE)  # measured on the bench


def incoming(design: Design) -> Incoming:
    """Return the design's `Incoming`, created once and cached with the design."""
    return memo(design, "incoming", lambda: Incoming(design))
