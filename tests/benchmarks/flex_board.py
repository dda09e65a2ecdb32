"""The steps from a spec to a board's files: on the four-coil template, and how each grows with turns, layers, coils."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from measure import Growth, growth, timed

import sitscad
from sitscad.files.formats import gerber
from sitscad.files.formats.kicad import project_files as kicad

ROOT = Path(__file__).parents[2]
TEMPLATE = ROOT / "templates" / "three_axis_grid.yaml"
STEPS = ("lay out", "estimate", "check", "Gerber and drill", "KiCad", "verify the files")
TURNS = (4, 8, 16, 32, 64, 128)
LAYERS = (1, 2, 4, 6, 8)
COILS = ((1, 1), (2, 1), (2, 2), (3, 2), (3, 3), (4, 3))
STACKUPS = {1: "flex-2l-18um", 2: "flex-2l-18um", 4: "flex-4l", 6: "flex-6l", 8: "flex-8l"}


def coil_spec(turns: float, layers: int = 2, shape: str = "circle", metal: bool = False) -> sitscad.SensorSpec:
    """One coil, as large as its turns ask for; with `metal` behind it."""
    coil = {"shape": shape, "outer_diameter": 2.5 + 0.42 * turns, "turns": turns, "layers": layers,
            "trace_width": 0.1, "trace_spacing": 0.1}
    document = {"sitscad": 1, "name": f"{shape}-{turns}-{layers}", "coil": coil, "fpc": {"stackup": STACKUPS[layers]}}
    return sitscad.load_text(json.dumps(document | ({"mount": {"standoff": 0.5}} if metal else {})))


def with_coils(columns: int, rows: int) -> sitscad.SensorSpec:
    """A grid of coils with more room between them than the template has."""
    coil = {"shape": "circle", "outer_diameter": 5, "turns": 8, "layers": 2, "trace_width": 0.1, "trace_spacing": 0.1}
    array = {"pattern": "grid", "count": [columns, rows], "pitch": 9} if columns * rows > 1 else {"pattern": "single"}
    document = {"sitscad": 1, "name": f"coils-{columns * rows}", "coil": coil, "array": array}
    return sitscad.load_text(json.dumps(document))


def steps(spec: sitscad.SensorSpec, folder: str) -> Iterator[tuple[str, partial]]:
    """Everything that a board needs, each step ready to run on what the steps before it made."""
    layout = sitscad.lay_out(spec)
    if layout.shortfalls:
        raise SystemExit(f"{spec.name} is not routed: {layout.shortfalls[0].message}")
    estimates = sitscad.estimate(layout)
    built = sitscad.build(spec, folder, only=("gerber",), force=True).directory
    works = (
        partial(sitscad.lay_out, spec),
        partial(sitscad.estimate, layout),
        partial(sitscad.check, spec, layout, estimates),
        lambda: (gerber.render(layout), gerber.render_drills(layout)),
        partial(kicad.render, layout),
        partial(sitscad.verify, built),
    )
    return zip(STEPS, works, strict=True)


def template() -> list[tuple[str, float, float]]:
    """(step, ms, spread) of the four-coil template."""
    with tempfile.TemporaryDirectory() as folder:
        return [(name, *timed(work)) for name, work in steps(sitscad.load(TEMPLATE), folder)]


def grown(turns=TURNS, coils=COILS, layers=LAYERS) -> Iterator[Growth]:
    """How the steps grow, and the whole estimate near metal by itself, round and square."""
    series = {
        "turns": {n: coil_spec(n) for n in turns},
        "layers": {n: coil_spec(12, n) for n in layers},
        "coils": {nx * ny: with_coils(nx, ny) for nx, ny in coils},
    }
    for over, specs in series.items():
        with tempfile.TemporaryDirectory() as folder:
            works = {number: dict(steps(spec, folder)) for number, spec in specs.items()}
            for step in STEPS:
                yield growth(f"step: {step}", over, [(number, work[step]) for number, work in works.items()])
    for shape in ("circle", "square"):
        layouts = {n: sitscad.lay_out(coil_spec(n, shape=shape, metal=True)) for n in turns}
        works = [(n, partial(sitscad.estimate, layout)) for n, layout in layouts.items()]
        yield growth(f"estimate over metal, {shape}", "turns", works)
