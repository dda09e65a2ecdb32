"""Land patterns of two-terminal chips on the flexible board: openings of the coverlay, and the room of a thermistor."""

from __future__ import annotations

from enum import StrEnum

from sitscad.basics.record import record
from sitscad.layout.lanes import Bus
from sitscad.spec.circuit import Chip
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import ArtworkSpec
from sitscad.spec.thermistor import BOARD


def chip_opening(rules: DesignRules, chip: Chip) -> float:
    """Return the distance (m) by which the coverlay's opening extends beyond a chip's pad.

    It is the coverlay's registration tolerance, or less if the strip of coverlay between the two pads would be too
    narrow.
    """
    between = (chip.pitch - chip.pad_along - rules.coverlay_web) / 2
    return max(0.0, min(rules.coverlay_registration, between))


class ThermistorSpot(StrEnum):
    """Area in which a soldered thermistor is placed.

    If coils are in line, the area on the body lies between leads, or between leads and edge. For other coils, it lies
    in the corner below all leads. If the spec states the outline of such a body, it lies at the beginning of the tail.
    """

    LEADS = "leads"
    CORNER = "corner"
    ROOT = "root"
    STIFFENER = "stiffener"


@record
class ThermistorRoom:
    """Room that a thermistor needs if its two pads lie behind each other along the tail's axis.

    The pad away from the tail has the passing track, which runs beside the other pad. Lengths are in metres.

    * ``clearance``: least distance of another track from a pad, because the coverlay is open beside the pad
    * ``to_edge``: least distance of a pad from the board's edge
    * ``passing``: distance across the tail from the pads' centres to the centre of the passing track
    * ``gap``: least distance of a lead's centre from the passing track's centre
    """

    chip: Chip
    opening: float
    clearance: float
    to_edge: float
    passing: float
    gap: float
    spot: ThermistorSpot

    @property
    def is_lowest(self) -> bool:
        """Whether the pads lie beside their tracks in the tail, below all others."""
        return self.spot in (ThermistorSpot.ROOT, ThermistorSpot.STIFFENER)

    @property
    def length(self) -> float:
        """Length of the pads with their clearances, along the tail's axis."""
        return self.chip.pitch + self.chip.pad_along + 2.0 * self.clearance

    def across(self, bounds_lead: bool) -> float:
        """Return the width that the thermistor needs across the tail.

        It begins at the edge of the lead beside the passing track. If `bounds_lead` is True, it ends at the edge of
        another lead beyond the pads, otherwise at the board's edge.
        """
        beyond = self.clearance if bounds_lead else self.to_edge
        return self.gap + self.passing + self.chip.pad_across / 2 + beyond


def thermistor_room(artwork: ArtworkSpec, bus: Bus, width: float) -> ThermistorRoom | None:
    """Return the room of the soldered thermistor, with tracks of `width` (m). None if the board carries none."""
    if artwork.thermistor is None or (chip := artwork.thermistor.part.chip) is None:
        return None
    rules = artwork.fpc.rules
    opening = chip_opening(rules, chip)
    clearance = max(rules.trace_spacing, opening + rules.coverlay_opening_to_trace)
    return ThermistorRoom(
        chip, opening, clearance, max(rules.copper_to_edge, opening + rules.coverlay_web),
        chip.pad_across / 2 + clearance + width / 2, max(bus.spacing, rules.trace_spacing) + width / 2,
        _spot(artwork, artwork.thermistor.at),
    )


def _spot(artwork: ArtworkSpec, place: str) -> ThermistorSpot:
    """Return the area of the thermistor on board or tail (`place`)."""
    if place != BOARD:
        return ThermistorSpot.STIFFENER
    if artwork.array.is_in_line:
        return ThermistorSpot.LEADS
    return ThermistorSpot.CORNER if artwork.fpc.body is None else ThermistorSpot.ROOT
