"""Specs built in code, so that these tests need no loader and can range widely."""

import pytest

from sitscad.spec import presets
from sitscad.spec.circuit import FpcSpec, PanelSpec, Tail
from sitscad.spec.coil import ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.profiles import installed_rules
from sitscad.spec.sensor import ReadoutSpec, Requirements, SensorSpec
from sitscad.spec.yaml.source import SpecSource


def sensor(
    shape="circle",
    diameter=4e-3,
    turns=7.75,
    layers=4,
    width=80e-6,
    spacing=80e-6,
    coils=2,
    pitch=4.5e-3,
    stackup="flex-4l",
    rules="generic-fine",
    tail=True,
    tail_layers=2,
    start_angle=0.0,
    clockwise=False,
    centres=None,
    corner_radius=0.0,
    size=None,
):
    """A sensor of coils in a line, or about some centres, everything else left out."""
    centres = centres or [((i - (coils - 1) / 2) * pitch, 0.0) for i in range(coils)]
    placements = tuple(CoilPlacement(f"C{i + 1}", tuple(centre)) for i, centre in enumerate(centres))
    return SensorSpec(
        name="drawn",
        coil=CoilSpec(
            shape,
            size or (diameter, diameter),
            turns,
            layers=tuple(range(1, layers + 1)),
            trace_width=width,
            trace_spacing=spacing,
            start_angle=start_angle,
            clockwise=clockwise,
            corner_radius=corner_radius,
        ),
        array=ArraySpec("line" if coils > 1 else "single", placements, pitch),
        fpc=FpcSpec(
            stackup=presets.stackup(stackup),
            rules=installed_rules(rules),
            panel=PanelSpec(),
            teardrops="none",
            tail=Tail(30e-3, presets.connector("zif-0.5mm"), layers=tail_layers, turn_radius=2e-3) if tail else None,
        ),
        target=None,
        elastomer=None,
        encapsulation=None,
        mount=None,
        shield=None,
        readout=ReadoutSpec(presets.converter("ldc1614"), None, "converter", None, None, 40e6, 100.0),
        requirements=Requirements(),
        source=SpecSource("drawn.yaml", ""),
    )


@pytest.fixture(name="sensor")
def sensor_fixture():
    return sensor
