"""The picture of a fit that fails: what is too much to scale and in red, its limit in black; none where it fits."""

from __future__ import annotations

from dataclasses import replace

import pytest
from legibility import assert_legible
from tolerance import approx

import sitscad
from sitscad.assembly.places.fit import pin_gaps
from sitscad.basics.finding import Finding, Severity
from sitscad.files.documents.drawings.fit import fit_sheet
from sitscad.files.drawing.frame import RED
from sitscad.files.drawing.sheet import Label, flat_items
from sitscad.kernels.geometry.path import bounding_box
from sitscad.package.stages import fit_picture_file
from sitscad.spec import templates


def fault(rule, name, key, measured, limit):
    return Finding(rule, name, Severity.ERROR, "", key=key, measured=measured, limit=limit, unit="m")


TALL = fault("SIT303", "stack-height", "mount.standoff", 5.4e-3, 5e-3)


@pytest.fixture(scope="module")
def layout():
    return sitscad.lay_out(sitscad.load_text(templates.read("grasper_4layer")))


def with_changes(layout, **changes):
    spec = layout.spec
    for key, value in changes.items():
        spec = spec.replace(key.replace("__", "."), value)
    return replace(layout, spec=spec)


def words(sheet, colour=RED):
    return [i.text for i in flat_items(sheet.items) if isinstance(i, Label) and i.colour == colour]


def test_fitting_sensor_has_no_fit_drawing(layout):
    assert fit_sheet(layout, []) is None
    assert fit_sheet(layout, [fault("SIT312", "elastomer-shear", "elastomer.material", 1.1, 1.0)]) is None


def test_needed_circle_is_drawn_to_scale_with_port(layout):
    sheet = fit_sheet(layout, [TALL])
    boxes = {item.name: bounding_box(item.paths) for item in flat_items(sheet.items) if getattr(item, "name", "")}
    needed, port = boxes["fit-needed"], boxes["jaw-port"]
    assert (needed[2] - needed[0]) / (port[2] - port[0]) == approx(5.4 / 5.0, rel=1e-6)
    assert words(sheet) == ["needs 5.40"] and "port 5.00" in words(sheet, "#000000")


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (fault("SIT301", "sensor-width", "fpc.margin", 5.2e-3, 4.8e-3), "board 5.20"),
        (fault("SIT301", "sensor-width", "elastomer.size", 5.2e-3, 4.8e-3), "elastomer 5.20"),
        (fault("SIT302", "sensor-length", "array.pitch", 10.3e-3, 8e-3), "board {0:.3f}"),
        (fault("SIT309", "shield-gap", "shield.gap", 3.5e-3, 4e-3), "shield 3.50"),
        (fault("SIT314", "printed-wall", "mount.standoff", 0.5e-3, 0.6e-3), "mount 0.50"),
        (fault("SIT321", "solids-in-port", "mount", 2.7e-3, 2.5e-3), "needs 5.40"),
    ],
)
def test_excess_size_is_labelled_in_red(layout, fault, said):
    sheet = fit_sheet(layout, [fault])
    assert said.format(1e3 * layout.body_size[0]) in words(sheet)
    assert_legible(replace(sheet, items=list(flat_items(sheet.items))))


def test_tail_at_hinge_pin_and_shaft_is_drawn(layout):
    changed = with_changes(layout, assembly__hinge_pin="2 mm", assembly__shaft_bore="2.4 mm")
    (gap, _) = [each for each in pin_gaps(changed) if not each.is_free]
    faults = [
        fault("SIT324", "tail-past-hinge", "mount.standoff", gap.away, gap.pin),
        fault("SIT325", "end-through-shaft", "fpc.tail.connector", 2.518e-3, 2.4e-3),
        TALL,
    ]
    sheet = fit_sheet(changed, faults, True)
    message = " ".join(words(sheet))
    assert "from the pivot" in message and "2.518 from corner to corner" in message and "IN SPITE OF" in message
    assert_legible(replace(sheet, items=list(flat_items(sheet.items))))


def test_pivot_offset_increases_gap_to_tail(layout):
    mount = layout.spec.mount
    raised = replace(mount, jaw=replace(mount.jaw, pivot_offset=-0.3e-3))
    moved = replace(layout, spec=replace(layout.spec, mount=raised))
    closed, before = pin_gaps(moved)[0].away, pin_gaps(layout)[0].away
    assert closed == approx(before + 0.3e-3, abs=1e-9)


@pytest.mark.slow
def test_package_has_fit_drawing_only_with_fit_errors():
    from sitscad.checks.policy import Policy
    from sitscad.package.stages import package_contents

    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml")
    assert fit_picture_file(package_contents(spec, Policy(), None), "") == {}
    tall = package_contents(spec.replace("elastomer.thickness", 1.6e-3), Policy(), None)
    made = fit_picture_file(tall, "")
    assert list(made) == ["fit.svg"] and b"needs 5.5" in made["fit.svg"]
    # It named mount/fit-solids.svg in packages that have none
    assert b"fit-solids" not in made["fit.svg"]
    assert b"mount/fit-solids.svg has the bodies" in fit_picture_file(tall, "mount/fit-solids.svg")["fit.svg"]
