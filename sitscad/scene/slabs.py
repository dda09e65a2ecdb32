"""The flat pieces over the board, elastomer and target: where each lies from above, and how high."""

from __future__ import annotations

from sitscad.geometry.footprint import Footprint
from sitscad.geometry.path import Path
from sitscad.record import record
from sitscad.spec.places import footprint
from sitscad.spec.sensor import SensorSpec


@record
class Slab:
    """A flat piece in its place: its outline from above, the heights (m) of its lower and its upper face, z = 0 being
    the board's top face, and what it is made of.
    """

    name: str
    footprint: Footprint
    lower: float
    upper: float
    material: str

    @property
    def heights(self) -> tuple[float, float]:
        """Both heights (m)."""
        return self.lower, self.upper

    def outline(self, margin: float = 0.0) -> Path:
        """Its outline from above, grown by `margin` (m) with round corners."""
        return self.footprint.outline(margin)


def elastomer(spec: SensorSpec) -> Slab | None:
    """The soft pad on the board's top face, at its nominal size (the laser's kerf is the cut file's business)."""
    pad = spec.elastomer
    if pad is None:
        return None
    return Slab("elastomer", footprint(spec, pad), 0.0, pad.thickness, pad.material.name)


def target(spec: SensorSpec) -> Slab | None:
    """The conducting plate on the elastomer at rest; on the board's top face where there is no elastomer."""
    plate = spec.target
    if plate is None:
        return None
    under = spec.elastomer.thickness if spec.elastomer is not None else 0.0
    return Slab("target", footprint(spec, plate), under, under + plate.thickness, plate.material.name)


def slabs(spec: SensorSpec) -> tuple[Slab, ...]:
    """Elastomer and target, those that the spec has."""
    return tuple(slab for slab in (elastomer(spec), target(spec)) if slab is not None)
