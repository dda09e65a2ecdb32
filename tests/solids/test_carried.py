"""What the board lies on, measured on the solids: as the figures say, and of a part of the user's own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import handmade
import numpy as np
import pytest
from tolerance import approx

from sitscad.assembly.places.bodies import BodyRole, board_heights
from sitscad.assembly.places.stack import support
from sitscad.assembly.places.tail_path import ROD, bends
from sitscad.assembly.solids import pieces
from sitscad.assembly.solids.clash import bending_rod_overlap, support_areas
from sitscad.assembly.solids.whole import whole
from sitscad.basics.finding import Severity
from sitscad.checks.assembly.fit import findings_on_solids, rules_in_fit_file
from sitscad.files.documents import mounting, tail_steps
from sitscad.layout import lay_out
from sitscad.spec import presets
from sitscad.spec.load import load
from sitscad.spec.mount import Finger

pytestmark = pytest.mark.cad

SENSOR = """sitscad: 1
name: own
coil: {shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
elastomer: {shape: square, size: 6, thickness: 1}
mount: {kind: custom, step: own.step}
"""


def kinds():
    """Every kind of mount, among them a seat that the port cuts back and one in a pad pocket."""
    bare = handmade.jaw_sensor(shield=None)
    thick = replace(bare.spec.elastomer, thickness=2.2e-3)
    yield "seat", bare
    yield "seat under a shield", handmade.jaw_sensor()
    yield "cut seat", handmade.jaw_sensor(shield=None, elastomer=thick)
    pocketed = replace(handmade.jaw(), recess=0.4e-3, pocket=(14e-3, 3.2e-3))
    yield "pocket", handmade.jaw_sensor(shield=None, mount=handmade.Mount("grasper-pad", pocketed, 1.0e-3))
    window = replace(handmade.jaw(), fenestration=(3e-3, 1.5e-3))
    yield "metal", handmade.jaw_sensor(shield=None, mount=handmade.Mount("grasper-pad", window, 0.0))
    for name in ("ati-nano17", "corners-m2"):
        plate = handmade.Mount("bench-plate", None, 2e-3, holes=presets.hole_pattern(name))
        yield name, handmade.bench_sensor(mount=plate)
    for shape, size in (("rectangle", (16e-3, 10e-3)), ("circle", (14e-3, 14e-3))):
        cap = handmade.Mount("fingertip", None, 1.2e-3, finger=Finger(shape, size, 8e-3, 2e-3))
        yield shape, handmade.bench_sensor(mount=cap)


KINDS = dict(kinds())


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_computed_support_area_matches_solids(kind):
    """Within 1 %: a face is looked for 5 um below itself, where a seat cut round by the port is narrower."""
    layout = KINDS[kind]
    plane, (pressed, body) = support(layout), support_areas(layout, whole(layout))
    assert pressed.value == approx(plane.carried, rel=1e-2)
    assert body.value == approx(plane.body_carried, rel=1e-2)
    assert pressed.first == plane.name and pressed.is_kept == (plane.share >= 0.9)


BENT = """sitscad: 1
name: own
coil: {shape: circle, outer_diameter: 7, turns: 8, layers: 4, trace_width: 155 um, trace_spacing: 155 um}
fpc: {stackup: flex-4l, tail: {length: 30, connector: zif-0.5mm}}
elastomer: {shape: circle, size: 8, thickness: 1.5}
mount: {kind: custom, step: own.step, standoff: 4}
"""


@pytest.mark.slow
def test_part_under_tail_bend_gives_warning_with_volume(tmp_path):
    """The steps had the tail bent about a line that the user's own block reaches under, and nothing was found."""
    import build123d as bd

    (tmp_path / "own.step").write_bytes(b"")
    (tmp_path / "spec.yaml").write_text(BENT)
    result = {}
    for length in (30.0, 0.0):
        first = None
        if not length:  # up to where the steps have it end
            layout = result[30.0][0]
            first = min(bends(layout), key=lambda bend: bend.start)
            length = 2e3 * (first.start - first.radius - ROD)
        block = bd.Solid.make_box(length, 20.0, 4.0).moved(bd.Location((-length / 2, -10.0, -4.0)))
        bd.export_step(block, tmp_path / "own.step")
        layout = lay_out(load(tmp_path / "spec.yaml"))
        (measured,) = bending_rod_overlap(layout, whole(layout))
        result[30.0 if first is None else 0.0] = layout, measured
    assert not result[30.0][1].is_kept and result[0.0][1].is_kept
    layout, measured = result[30.0]
    tail_bends = bends(layout)
    first = min(tail_bends, key=lambda bend: bend.start)
    rod, (low, high) = first.radius + ROD, layout.reach_at(first.start)
    x, top = np.linspace(first.start - rod, 15e-3, 4001), board_heights(layout.spec.fpc.stackup)[0]
    face, half = top - layout.spec.assembly.glue_line, np.sqrt(np.maximum(0.0, rod**2 - (x - first.start) ** 2))
    middle = measured.where[2]
    heights = np.minimum(face, middle + half) - np.maximum(face - 4e-3, middle - half)
    expected = (high - low) * np.trapezoid(np.maximum(0.0, heights), x)
    assert measured.value == approx(float(expected), rel=1e-2)
    document = {"measured": [mounting._value_document(measured)]}
    (finding,) = findings_on_solids(document, layout.spec.readout.device, layout.spec.source)
    assert (finding.rule, finding.severity, finding.key) == ("SIT320", Severity.WARNING, "mount")
    end = f"{1e3 * (first.start - rod - layout.body[2]):.2f}".rstrip("0")
    assert end in tail_steps.custom_mount_end_text(layout.body[2], tail_bends)


def built(tmp_path, size):
    """What a build measures of a mount of one's own, a block of so many mm across whose face is at the datum."""
    import build123d as bd

    bd.export_step(bd.Solid.make_box(*size).moved(bd.Location((-size[0] / 2, -size[1] / 2, -size[2]))),
                   tmp_path / "own.step")
    (tmp_path / "spec.yaml").write_text(SENSOR)
    spec = load(tmp_path / "spec.yaml")
    layout = lay_out(spec)
    document = json.loads(mounting.render_fit(layout, whole(layout))["mount/fit.json"])
    assert rules_in_fit_file(document) == {"SIT320", "SIT326", "SIT333"}
    return findings_on_solids(document, spec.readout.device, spec.source), document["measured"]


@pytest.mark.slow
def test_sufficient_block_has_no_finding(tmp_path):
    assert built(tmp_path, (12, 12, 3))[0] == ()


@pytest.mark.slow
@pytest.mark.parametrize(("side", "severity"), [(5.0, Severity.WARNING), (2.0, Severity.ERROR)])
def test_block_smaller_than_pad_gives_finding_with_both_areas(tmp_path, side, severity):
    (result, *_), _ = built(tmp_path, (side, 6.0, 3.0))
    assert (result.rule, result.severity) == ("SIT326", severity)
    assert (result.measured, result.limit) == (approx(6e-3 * side * 1e-3, rel=1e-6), approx(0.9 * 36e-6, rel=1e-6))


@pytest.mark.slow
def test_seat_that_kernel_cuts_wrongly_has_mesh_volume():
    """The kernel's common part of this seat and its port was nothing at all, and no mount was built; the volume is that
    of the meshes' common part, less what the edge under the tail is rounded by.
    """
    layout = lay_out(load(Path(__file__).parents[2] / "templates/grasper_3p5mm.yaml"))
    (seat,) = pieces.mount(layout)
    assert seat.shape.is_valid and seat.volume == approx(47.03e-9, rel=1e-4)


def test_cap_without_standoff_is_valid_and_has_no_support_measure():
    finger = KINDS["rectangle"].spec.mount.finger
    layout = handmade.bench_sensor(mount=handmade.Mount("fingertip", None, 0.0, finger=finger))
    (cap,) = pieces.mount(layout)
    assert cap.shape.is_valid and support_areas(layout, (cap,)) == ()


def test_custom_mount_without_file_supports_board_over_shield():
    mount = replace(handmade.Mount("bench-plate", None, 3e-3), kind="custom")
    layout = handmade.bench_sensor(mount=mount, shield=handmade.jaw_sensor().spec.shield)
    solids = whole(layout)
    assert any(solid.role is BodyRole.SHIELD for solid in solids)
    assert support_areas(layout, solids) == ()
