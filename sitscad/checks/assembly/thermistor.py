"""SIT338: whether a thermistor on the board lies beside the plates, and below everything that presses on them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from sitscad.assembly.places.bodies import Body, plates_of, top_height
from sitscad.basics.finding import Place, Severity
from sitscad.checks.fixes.moves import SMALL_PARTS, reread_change, reread_changes
from sitscad.checks.rules import ROUNDING, Rule, Verdict, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import bounding_box
from sitscad.kernels.mechanics.elastomer import VALID_STRAIN
from sitscad.spec.thermistor import BOARD


def thermistor_fit(design: Design) -> Iterator[Verdict]:
    """Yield findings on a thermistor on the board that lies under a plate, or that stands higher than the plates.

    With the pad compressed by the largest strain of its law (SIT304), nothing that presses on the target may touch the
    thermistor. In a jaw, this is an error; otherwise it is a note, because a narrower part can press.
    """
    spec = design.spec
    sensor, part = design.layout.thermistor, spec.soldered_thermistor
    if sensor is None or part is None or part.at != BOARD:
        return
    place = Place(*sensor.centre, 1, sensor.nets)
    distance = distance_from_plates(sensor.box, plates_of(spec).all)
    if distance is not None and distance < spec.fpc.rules.outline_tolerance - ROUNDING:
        yield violation_of("thermistor-under", "readout.thermistor.at", distance, spec.fpc.rules.outline_tolerance, "m",
                           place=place, fixes=(partial(reread_change, spec, "readout.thermistor.at", "tail"),),
                           part=part.part.product)
    pad = spec.elastomer
    if spec.target is None and pad is None:
        return
    recess = spec.jaw.opposing_recess if spec.jaw is not None else 0.0
    room = top_height(spec) - recess - (pad.thickness * VALID_STRAIN if pad is not None else 0.0)
    if part.part.height > room + ROUNDING:
        yield violation_of(
            "thermistor-high", "readout.thermistor.part", part.part.height, room, "m", place=place,
            severity=None if spec.jaw is not None else Severity.NOTE,
            fixes=(partial(reread_changes, spec, "readout.thermistor.part", SMALL_PARTS),
                   partial(reread_change, spec, "readout.thermistor.at", "tail")), part=part.part.product,
        )


def distance_from_plates(own: Box, plates: Sequence[Body]) -> float | None:
    """Return the distance (m) from the box `own` of a thermistor's pads to the nearest plate. Negative if they overlap.

    The distance is the larger of the distances along x and along y. None if the sensor has no plates.
    """
    boxes = [bounding_box([body.outline()]) for body in plates]
    return min((max(own[0] - box[2], box[0] - own[2], own[1] - box[3], box[1] - own[3]) for box in boxes), default=None)


RULES: tuple[Rule, ...] = (rule_of("SIT338", thermistor_fit, "soldered thermistor"),)
