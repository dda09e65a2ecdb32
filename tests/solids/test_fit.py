"""The closed pair in its port: from the figures and from the meshes, which know nothing of each other."""

from __future__ import annotations

from dataclasses import replace

import handmade
import pytest
from envelope import envelope_radius
from solid_pairs import clearances, interferences
from tolerance import approx

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.places.fit import closed_section
from sitscad.assembly.solids import Solid
from sitscad.assembly.solids.solid import box
from tests.oracles.envelope import closed_pair

FITTED = {
    "as made": {},
    "thin jaw": {"mount": handmade.Mount("grasper-pad", handmade.jaw(height=1.0e-3), 1.0e-3)},
    "with an opposing pad": {"mount": handmade.Mount("grasper-pad", handmade.jaw(height=1.1e-3, pad=0.3e-3), 0.8e-3)},
    "narrow jaw": {"mount": handmade.Mount("grasper-pad", handmade.jaw(3e-3, 1.0e-3), 0.9e-3), "encapsulation": None},
    "shield decides": {
        "mount": handmade.Mount("grasper-pad", handmade.jaw(height=0.9e-3), 1.5e-3),
        "shield": handmade.Shield(handmade.COPPER, 0.1e-3, 1.0e-3),
    },
    "wide target": {
        "target": handmade.Target("rectangle", (4e-3, 4.6e-3), 0.2e-3, handmade.COPPER),
        "mount": handmade.Mount("grasper-pad", handmade.jaw(height=1.0e-3), 0.8e-3),
    },
    "bare board": {"elastomer": None, "target": None},
}


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.cad
@pytest.mark.parametrize("case", FITTED)
def test_computed_envelope_matches_meshes(case):
    layout = handmade.jaw_sensor(**FITTED[case])
    pair = closed_pair(layout)
    section = closed_section(layout)
    assert envelope_radius(pair) == approx(section.radius, rel=1e-4)
    assert interferences(pair) == ()
    jaws = [s.shape.bounding_box() for s in pair if s.role in (BodyRole.JAW, BodyRole.OPPOSING_JAW)]
    height = max(b.max.Z for b in jaws) - min(b.min.Z for b in jaws)
    assert height * 1e-3 == approx(section.height, rel=1e-6)


def test_closed_height_is_sum_of_stack():
    section = closed_section(handmade.jaw_sensor())
    assert section.height == approx(2 * 1.2e-3 + 1.0e-3 + 0.2e-3 + 1e-3 + 0.2e-3 + 0.1e-3, rel=1e-6)
    assert section.radius < 2.5e-3 < section.likely_radius < section.worst_radius
    assert section.fits


def test_high_or_wide_pair_does_not_fit_and_names_part():
    high = closed_section(handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", handmade.jaw(height=1.4e-3), 1e-3)))
    assert not high.fits
    assert "jaw" in high.decided_by
    wide = closed_section(handmade.jaw_sensor(**FITTED["wide target"]))
    assert not wide.fits
    assert wide.decided_by == "encapsulation"


def test_sensor_without_jaw_has_no_closed_pair():
    assert closed_section(handmade.bench_sensor()) is None


@pytest.mark.slow
@pytest.mark.cad
def test_envelope_includes_both_jaws_without_tail():
    with pytest.raises(ValueError, match="opposing jaw"):
        envelope_radius(handmade.solids("jaw"))
    layout = handmade.jaw_sensor()
    wide_end = handmade.board(layout.spec, tail=20e-3, end_width=8e-3)
    pair = closed_pair(wide_end)
    assert envelope_radius(pair) < 2.5e-3
    assert envelope_radius(pair, within=(-10e-3, 40e-3)) == approx(4e-3, rel=1e-2)


@pytest.mark.cad
def test_two_boxes_have_clearance_or_interference():
    first = Solid("a", box(0.0, 0.0, 0.0, 1e-3, 1e-3, 1e-3), "m", "#000000", BodyRole.MOUNT)

    def second(x: float) -> Solid:
        return replace(first, name="b", shape=box(x, 0.0, 0.0, x + 1e-3, 1e-3, 1e-3))

    (apart,) = clearances((first, second(1.3e-3)))
    assert apart.gap == approx(0.3e-3, rel=1e-6)
    assert interferences((first, second(1e-3))) == ()
    assert clearances((first, second(1e-3)))[0].gap == approx(0.0, abs=1e-12)
    ((*names, volume),) = interferences((first, second(0.75e-3)))
    assert names == ["a", "b"]
    assert volume == approx(0.25e-9, rel=1e-6)


@pytest.mark.cad
def test_part_moved_into_neighbour_is_found():
    import build123d as bd

    moved = [
        replace(s, shape=s.shape.moved(bd.Location((0, 0, -0.01)))) if s.role is BodyRole.TARGET else s
        for s in handmade.solids("jaw")
    ]
    ((*names, volume),) = interferences(tuple(moved))
    assert set(names) == {"elastomer", "target"}
    assert volume == approx(4e-3 * 4e-3 * 0.01e-3, rel=1e-6)


@pytest.mark.slow
@pytest.mark.cad
def test_shield_gap_and_board_standoff_have_stated_values():
    gaps = {(c.first, c.second): c.gap for c in clearances(handmade.solids("jaw"))}
    assert gaps["shield", "board"] == approx(0.6e-3, rel=1e-6)
    assert gaps["jaw", "board"] == approx(1.0e-3, rel=1e-6)
    assert gaps["board", "target"] == approx(1.0e-3, rel=1e-6)
    assert gaps["board", "elastomer"] == approx(0.0, abs=1e-12)
