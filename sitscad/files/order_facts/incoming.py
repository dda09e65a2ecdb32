"""What comes in from the fabricator: the panel, its coupon, and bare boards on the bench at 20 degrees Celsius."""

from __future__ import annotations

from functools import cached_property

from sitscad.basics.record import kept, record, replace
from sitscad.estimates import Estimates, estimated
from sitscad.estimates.design import ROOM_TEMPERATURE, Design, at_room_temperature
from sitscad.estimates.states.steps import metered
from sitscad.layout.panel import Panel, plan


@record(eq=False)
class Incoming:
    """What is ordered and tested of a design, each thing worked out when it is first asked for, and once."""

    design: Design

    @cached_property
    def panel(self) -> Panel | None:
        """The panel in which the boards are ordered; None where they are ordered singly."""
        return plan(self.design.layout)

    @cached_property
    def board(self) -> Estimates:
        """The electrical numbers at 20 degrees Celsius, at which boards are tested, with what a meter reads of them."""
        estimates = at_room_temperature(self.design).estimates
        return replace(estimates, metered=metered(self.design.layout, ROOM_TEMPERATURE))

    @cached_property
    def coupon(self) -> Estimates | None:
        """The electrical estimate of the panel's coupon, which lies in free air; None where there is no coupon."""
        if self.panel is None or self.panel.coupon is None:
            return None
        return estimated(self.panel.coupon, temperature=ROOM_TEMPERATURE)  # it is measured on the bench


def incoming(design: Design) -> Incoming:
    """What is ordered and tested of a design, one value a design."""
    return kept(design, "incoming", lambda: Incoming(design))
