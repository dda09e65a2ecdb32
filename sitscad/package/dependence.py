"""What of a spec the files of a stage depend on: a changed value makes only those stages anew that read it.

Left out is what a test has changed and seen to leave every byte of a stage as it was; what is not named here counts for
every stage. Whatever is left out by mistake would leave a stale file in a package: nothing is left out to save little.
"""

from __future__ import annotations

import dataclasses

from sitscad.geometry.path import bounding_box
from sitscad.layout.board import Layout
from sitscad.layout.thickness import tail_layers
from sitscad.spec.sensor import SensorSpec

_ELECTRICAL = ("requirements", "readout", "source")

UNREAD: dict[str, tuple[str, ...]] = {
    "kicad": _ELECTRICAL,
    "laser": _ELECTRICAL,
    "mount": _ELECTRICAL,
    "mesh": _ELECTRICAL,
    "assembly": ("source",),
}

"""The parts of a spec that a stage does not read; of the readout all read the converter and the capacitors' pads."""


BESIDE_TAIL = ("mount", "mesh")
"""Stages that read of the tail only where it begins."""


def read_by(stage: str, spec: SensorSpec) -> tuple[object, ...]:
    """The parts of a spec that a stage reads, in the order of their names."""
    unread = UNREAD.get(stage, ())
    parts = [getattr(spec, field.name) for field in dataclasses.fields(spec) if field.name not in unread]
    return (*parts, spec.readout.device, spec.readout.chip)


def read_of_board(stage: str, layout: Layout) -> tuple[object, ...]:
    """What a stage of printed pieces and meshes reads: the spec without its tail, and the board as far as `NEAR` from
    its body, so that a longer tail prints no new mount.
    """
    spec = dataclasses.replace(layout.spec, fpc=dataclasses.replace(layout.spec.fpc, tail=None, boards=None))
    far = layout.body[2] + NEAR
    near = tuple(point for point in layout.outline.flattened(1e-6) if point.x < far)
    plate = layout.stiffener
    if plate is not None and bounding_box((plate.outline.outline,))[0] > far:
        plate = None
    return (*read_by(stage, spec), layout.body, near, plate, layout.copper_layers, tail_layers(layout))


NEAR = 15e-3
"""How far (m) beyond the board's body a mount, a jig or a mould reaches at most, and then some."""
