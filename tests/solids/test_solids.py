"""The solids: what there is, how large, where, and that no two claim the same place."""

from __future__ import annotations

import math

import handmade
import pytest
from handmade import bounds
from solid_pairs import interferences
from tolerance import approx

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.solids import PartsError, solids
from sitscad.assembly.solids.solid import face, manifold, tessellate
from sitscad.kernels.geometry.path import Path, Point, Region, circle, enclosed_area, rectangle

pytestmark = pytest.mark.cad

NAMES = {
    "jaw": "jaw mount shield mount-spacer stiffener board elastomer target encapsulation",
    "solder-pads": "jaw mount shield mount-spacer board elastomer target encapsulation",
    "round": "jaw mount shield mount-spacer stiffener board elastomer target encapsulation",
    "overhanging": "jaw mount stiffener board elastomer target encapsulation",
    "oblique": "jaw mount shield mount-spacer stiffener board elastomer target encapsulation",
    "bench": "mount stiffener board elastomer target",
    "bench-shielded": "mount shield mount-spacer stiffener board elastomer target",
    "bare": "stiffener board",
}


def named(sensor: str) -> dict:
    return {solid.name: solid for solid in handmade.solids(sensor)}


@pytest.mark.parametrize("sensor", handmade.SENSORS)
def test_shapes_carry_no_location(sensor):
    """A shape that carries a location is written to STEP as an instance with a running number for a name."""
    for solid in handmade.solids(sensor):
        assert solid.shape.wrapped.Location().IsIdentity(), solid.name


@pytest.mark.parametrize("sensor", handmade.SENSORS)
def test_solids_contain_only_parts_of_spec(sensor):
    assert [solid.name for solid in handmade.solids(sensor)] == NAMES[sensor].split()


@pytest.mark.parametrize("sensor", handmade.SENSORS)
def test_solids_are_valid_with_closed_meshes(sensor):
    for solid in handmade.solids(sensor):
        assert solid.shape.is_valid, solid.name
        body = manifold(tessellate(solid))
        assert body.volume() * 1e-9 == approx(solid.volume, rel=2e-3), solid.name


@pytest.mark.parametrize("sensor", handmade.SENSORS)
def test_solids_share_no_volume(sensor):
    assert interferences(handmade.solids(sensor)) == ()


@pytest.mark.parametrize("sensor", ["jaw", "oblique", "bench", "bare"])
def test_volumes_are_areas_times_thicknesses(sensor):
    layout, result = handmade.layout(sensor), named(sensor)
    spec, thickness = layout.spec, layout.spec.fpc.stackup.thickness
    assert result["board"].volume == approx(abs(enclosed_area(layout.outline)) * thickness, rel=1e-9)
    assert result["stiffener"].volume == approx(layout.stiffener.outline.area * 0.15e-3, rel=1e-9)
    for part in (spec.elastomer, spec.target):
        if part is not None:
            name = "elastomer" if part is spec.elastomer else "target"
            assert result[name].volume == approx(part.size[0] * part.size[1] * part.thickness, rel=1e-9)


def test_round_parts_have_disc_volume():
    result = named("round")
    assert result["elastomer"].volume == approx(math.pi * 2e-3**2 * 1e-3, rel=1e-9)
    assert result["target"].volume == approx(math.pi * 1.5e-3**2 * 0.2e-3, rel=1e-9)


def test_solid_heights_follow_stack():
    result = named("jaw")
    heights = {name: (bounds(solid)[2], bounds(solid)[5]) for name, solid in result.items()}
    wanted = {
        "board": (-0.2e-3, 0.0),
        "elastomer": (0.0, 1e-3),
        "target": (1e-3, 1.2e-3),
        "encapsulation": (0.0, 1.3e-3),
        "shield": (-0.9e-3, -0.8e-3),
        "mount-spacer": (-0.8e-3, 0.0),  # its cheeks beside the tail
        "mount": (-1.2e-3, 0.0),
        "jaw": (-2.4e-3, -1.2e-3),
        "stiffener": (-0.35e-3, -0.2e-3),
    }
    for name, levels in wanted.items():
        assert heights[name] == approx(levels, abs=1e-9), name


def test_pad_is_centred_on_array():
    from dataclasses import replace

    layout = handmade.bare(
        elastomer=handmade.ElastomerPad(handmade.SOFT, "square", (2e-3, 2e-3), 1e-3, 0.0),
    )
    coils = (handmade.CoilPlacement("C1", (1e-3, 0.2e-3)), handmade.CoilPlacement("C2", (2e-3, 0.4e-3)))
    spec = replace(layout.spec, array=handmade.ArraySpec("explicit", coils))
    pad = next(s for s in solids(replace(layout, spec=spec)) if s.role is BodyRole.ELASTOMER)
    assert bounds(pad) == approx((0.5e-3, -0.7e-3, 0.0, 2.5e-3, 1.3e-3, 1e-3), abs=1e-9)


@pytest.mark.parametrize("sensor", ["jaw", "round", "overhanging", "oblique"])
def test_film_has_minimum_thickness_everywhere(sensor):
    """What a ball of the film's radius sweeps over target and pad stays inside film, target, pad and board."""
    m3 = pytest.importorskip("manifold3d")
    result = {name: manifold(tessellate(solid)) for name, solid in named(sensor).items()}
    ball = m3.Manifold.sphere(0.098, 24)
    inside = result["encapsulation"] + result["target"] + result["elastomer"]
    for name in ("target", "elastomer"):
        grown = result[name].minkowski_sum(ball).trim_by_plane((0.0, 0.0, 1.0), 0.0)
        assert (grown - inside).volume() < 2e-4, name


def test_rotated_target_and_offset_pad_have_written_positions():
    """The target's corners, turned by 30 degrees counter-clockwise, seen from the mean of the coils' centres."""
    result = named("oblique")
    assert bounds(result["elastomer"])[:2] == approx((-1.9e-3, -1.7e-3), abs=1e-9)
    at = [(v.X * 1e-3, v.Y * 1e-3) for v in result["target"].shape.vertices()]
    cos, sin = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    corner = (0.9e-3 + cos * 2e-3 - sin * 0.6e-3, 0.2e-3 + sin * 2e-3 + cos * 0.6e-3)
    assert min(math.dist(corner, place) for place in at) < 1e-9


def test_contacts_on_body_are_not_covered_by_film():
    film, opening = named("solder-pads")["encapsulation"], handmade.layout("solder-pads").top_openings[0]
    covered = named("jaw")["encapsulation"]
    assert covered.volume - film.volume == approx(opening.area * 0.1e-3, rel=1e-3)


def test_film_outer_edges_are_rounded():
    """Rounding four upright and four upper edges takes (1 - pi/4) r^2 of each away: less than the sharp block."""
    result = named("jaw")
    sharp = (4.2e-3**2 * 1.3e-3) - result["elastomer"].volume - result["target"].volume
    layout = handmade.layout("jaw")
    flange = (abs(enclosed_area(handmade.with_solder_pads(layout).outline)) - 4.2e-3**2) * 0.1e-3
    assert result["encapsulation"].volume < sharp + flange
    kinds = {face.geom_type.name for face in result["encapsulation"].shape.faces()}
    assert kinds & {"TORUS", "SPHERE"}


def test_unfitting_shield_is_refused_with_needed_standoff():
    layout = handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", handmade.jaw(), 0.5e-3))
    with pytest.raises(PartsError, match=r"mount\.standoff at least 0\.7 mm"):
        solids(layout)


@pytest.mark.cad
def test_tail_of_fewer_layers_has_documented_thickness():
    """The assembly had a tail of all four layers, 261 um, where two run down it."""
    import sitscad
    from sitscad.assembly.places.stack import tail_heights
    from sitscad.assembly.solids.pieces import assemble, board_body
    from sitscad.assembly.solids.solid import manifold, tessellate
    from sitscad.spec import templates

    layout = sitscad.lay_out(sitscad.load_text(templates.read("grasper_4layer"), "t.yaml"))
    body = board_body(layout.outline, layout.body[2], layout.spec.fpc)
    under = tail_heights(layout.spec.fpc)[0]
    assert -layout.spec.fpc.stackup.thickness < under < 0.0
    tail = manifold(tessellate(body)).trim_by_plane((1.0, 0.0, 0.0), layout.body[2] * 1e3 + 1e-6)
    assert tail.bounding_box()[2] == approx(under * 1e3, abs=1e-6)
    plate = next(solid for solid in assemble(layout) if solid.name == "stiffener")
    lowest, plate_top = body.shape.bounding_box().min.Z, plate.shape.bounding_box().max.Z
    assert body.shape.is_valid and lowest == approx(-layout.spec.fpc.stackup.thickness * 1e3, abs=1e-6)
    assert plate_top == approx(under * 1e3, abs=1e-6)


def test_corner_coordinates_are_independent_of_memory_addresses():
    middle = Point(-2.7712812921102037e-3, 0.0)
    ring = Region(circle(middle, 2e-3), (circle(middle, 8.4e-4),))
    stored = [face(ring) for _ in range(40)]
    assert len({tuple(tuple(vertex) for vertex in each.vertices()) for each in stored}) == 1


def test_disjoint_path_is_refused_as_face():
    sides = rectangle(0.0, 0.0, 1e-3, 2e-3).segments
    apart = Path((sides[0],)).shifted(0.0, -1e-5).segments
    with pytest.raises(ValueError, match="do not join"):
        face(Region(Path((*sides[1:3], *apart, sides[3]))))
