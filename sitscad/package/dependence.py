"""What of a spec the files of a stage depend on: a changed value makes only those stages anew that read it.

Left out is what a test has changed and seen to leave every byte of a stage as it was; what is not named here counts for
every stage. Whatever is left out by mistake would leave a stale file in a package: nothing is left out to save little.
"""

from __future__ import annotations

import dataclasses

from sitscad.spec.sensor import SensorSpec

_ELECTRICAL = ("requirements", "readout", "source")
_OVER_THE_BOARD = ("target", "elastomer", "encapsulation", "shield")

UNREAD: dict[str, tuple[str, ...]] = {
    "kicad": (*_ELECTRICAL, *_OVER_THE_BOARD),
    "laser": _ELECTRICAL,
    "mount": _ELECTRICAL,
    "mesh": _ELECTRICAL,
}
"""The parts of a spec that a stage does not read; of the readout all read the converter and the capacitors' pads."""


def read_by(stage: str, spec: SensorSpec) -> tuple[object, ...]:
    """The parts of a spec that a stage reads, in the order of their names."""
    unread = UNREAD.get(stage, ())
    parts = [getattr(spec, field.name) for field in dataclasses.fields(spec) if field.name not in unread]
    return (*parts, spec.readout.device, spec.readout.chip)
