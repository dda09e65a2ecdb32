"""Figures and solids, judged by two ways that know nothing of each other, agree over random sensors."""

from __future__ import annotations

import random
import re
from dataclasses import replace

import handmade
import pytest
from tolerance import approx

from sitscad.assembly.places.bodies import BodyRole, plates_of
from sitscad.assembly.places.fit import closed_section
from sitscad.assembly.places.state import Pose
from sitscad.assembly.solids.clash import clashes
from sitscad.assembly.solids.proof import BULGE, INTERFERENCE, OPENING, PORT, TRAVEL, PadLoad, measure_solids
from sitscad.assembly.solids.solid import Solid, TriangleMesh, box, manifold, shared_volume
from sitscad.assembly.solids.whole import whole
from sitscad.checks.assembly.fit import findings_on_solids, rules_in_fit_file
from sitscad.estimates.design import Design
from sitscad.files.documents import mounting
from sitscad.files.drawing.pictures.rendered import clash_svg
from sitscad.spec.materials import Encapsulation, Shield
from sitscad.spec.mount import Assembly

pytestmark = pytest.mark.cad

GLUED = Assembly(None, 30e-6, 20e-6)


def random_sensor(seed):
    """A sensor in a jaw, some too high or too wide for the port, glued with lines of up to 0.1 mm."""
    chance = random.Random(seed)
    jaw = handmade.jaw(chance.uniform(3e-3, 4.8e-3), chance.uniform(0.9e-3, 1.5e-3), chance.choice((0.0, 0.2e-3)))
    jaw = replace(jaw, hinge=chance.choice((None, 8e-3)), opening=1.0)
    if chance.random() < 0.3:
        jaw = replace(jaw, recess=0.4e-3, pocket=(14e-3, 0.7 * jaw.width))
    standoff = chance.choice((0.7e-3, 1.1e-3, 1.4e-3))
    changes = {
        "mount": handmade.Mount("grasper-pad", jaw, standoff),
        "shield": Shield(handmade.COPPER, 0.1e-3, 0.6e-3) if chance.random() < 0.6 else None,
        "encapsulation": Encapsulation(handmade.PDMS, 0.08e-3) if chance.random() < 0.7 else None,
    }
    layout = handmade.jaw_sensor(**changes)
    layout = handmade.board(layout.spec, body=(9e-3, chance.uniform(3.6e-3, 4.8e-3)))
    return replace(layout, spec=replace(layout.spec, assembly=replace(GLUED, glue_line=chance.uniform(0.0, 1e-4))))


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    "seed",
    [
        *(0, 1, 93, 118),
        *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 12)),
        *(pytest.param(seed, marks=[pytest.mark.slow, pytest.mark.more]) for seed in range(12, 40)),
    ],
)
def test_computed_fit_matches_solids(seed):
    layout = random_sensor(seed)
    proof, plane = measure_solids(layout, whole(layout)), closed_section(layout)
    assert proof.radius == approx(plane.radius, abs=6e-6)
    assert {each.what for each in proof.faults} <= {PORT}
    if abs(plane.radius - plane.port_radius) > 6e-6:
        assert proof.fits == plane.fits


@pytest.mark.slow
def test_glued_pieces_have_gap_of_glue_line():
    layout = handmade.jaw_sensor()
    layout = replace(layout, spec=replace(layout.spec, assembly=GLUED))
    gaps = {(c.first, c.second): c.gap for c in measure_solids(layout, whole(layout)).clearances}
    for pair in (("jaw", "mount"), ("mount", "shield"), ("mount-spacer", "board"), ("board", "elastomer"),
                 ("elastomer", "target")):
        assert gaps[pair] == approx(30e-6, abs=1e-9), pair
    assert gaps["encapsulation", "opposing-jaw"] == approx(0.0, abs=1e-9)


@pytest.fixture(scope="module")
def hinged():
    layout = handmade.jaw_sensor()
    jaw = replace(layout.spec.mount.jaw, hinge=8e-3, opening=1.0, port_diameter=5.5e-3)
    return replace(layout, spec=replace(layout.spec, mount=replace(layout.spec.mount, jaw=jaw), assembly=GLUED))


@pytest.fixture(scope="module")
def pieces(hinged):
    return whole(hinged)


def said(layout, pieces, loads=()):
    """The proof's faults, and the findings that a build makes of them."""
    proof = measure_solids(layout, pieces, loads)
    document, spec = mounting.fit_document(proof), layout.spec
    return proof.faults, findings_on_solids(document, spec.readout.device, spec.source)


@pytest.mark.slow
def test_fitting_sensor_has_no_findings_and_all_rules_checked(hinged, pieces):
    gentle = (PadLoad("1 N of press", Pose(z=-1e-5), 1e-5),)
    assert said(hinged, pieces, gentle) == ((), ())
    document = mounting.fit_document(measure_solids(hinged, pieces, gentle))
    assert rules_in_fit_file(document) == {"SIT320", "SIT321", "SIT322", "SIT323"}


@pytest.mark.slow
def test_overlapping_pieces_are_found_with_volume(hinged, pieces):
    import build123d as bd

    down = bd.Location((0, 0, -0.1))
    sunk = tuple(replace(s, shape=s.shape.moved(down)) if s.name == "opposing-jaw" else s for s in pieces)
    faults, findings = said(hinged, sunk)
    (fault,) = [each for each in faults if each.what == INTERFERENCE and "encapsulation" in (each.first, each.second)]
    film = next(s for s in pieces if s.name == "encapsulation")
    both = film.shape & next(s for s in sunk if s.name == "opposing-jaw").shape
    assert fault.value == approx(sum(part.volume for part in both.solids()) * 1e-9, rel=1e-9)
    assert findings[0].rule == "SIT320" and "interference" in findings[0].cases and findings[0].place


def test_post_over_opposing_jaw_blocks_opening(hinged, pieces):
    top = max(s.shape.bounding_box().max.Z for s in pieces) * 1e-3
    post = Solid("post", box(-7e-3, -1e-3, top + 1e-3, -6e-3, 1e-3, top + 2e-3), "steel", "#000000", BodyRole.MOUNT)
    faults, findings = said(hinged, (*pieces, post))
    (hit,) = [each for each in faults if each.what == OPENING]
    assert (hit.first, hit.second) == ("post", "opposing-jaw") and hit.value > 1e-10
    (finding,) = [each for each in findings if each.rule == "SIT322"]
    assert finding.cases[0] == "jaws-open" and finding.detail


def test_piece_beyond_port_circle_is_found(hinged, pieces):
    post = Solid("post", box(-1e-3, 2.8e-3, -1e-4, 1e-3, 2.9e-3, 0.0), "steel", "#000000", BodyRole.MOUNT)
    faults, findings = said(hinged, (*pieces, post))
    assert [(each.what, each.first) for each in faults] == [(PORT, "post")]
    assert findings[0].rule == "SIT321" and findings[0].measured > 2.9e-3 and findings[0].limit == 2.75e-3


def test_loaded_target_and_pad_collide_with_neighbour(hinged, pieces):
    target = next(s for s in pieces if s.name == "target").shape.bounding_box()
    edge = (target.max.X + 0.3) * 1e-3
    block = box(edge, -1e-3, 0.1e-3, edge + 1e-4, 1e-3, target.max.Z * 1e-3)
    post = Solid("post", block, "steel", "#000000", BodyRole.MOUNT)
    around = tuple(s for s in pieces if s.role is not BodyRole.ENCAPSULATION)
    near = PadLoad("little", Pose(x=0.2e-3, z=-0.05e-3), 0.1e-3)
    far = PadLoad("much", Pose(x=0.4e-3, z=-0.05e-3), 0.5e-3)
    assert {(each.what, each.condition) for each in said(hinged, (*around, post), (near, far))[0]} == {
        (TRAVEL, "much"),
        (BULGE, "much"),
    }
    measured = measure_solids(hinged, (*around, post), (near,)).measured
    travel = next(each for each in measured if each.what == TRAVEL and each.first == "target")
    assert travel.second == "post" and travel.value == approx(0.1e-3, abs=1e-6)


def test_bulged_pad_has_unchanged_volume():
    """A parabola over the height that is left, round the pad: what the press took away."""
    spec = handmade.jaw_sensor().spec
    pad, press = spec.elastomer, 0.1 * spec.elastomer.thickness
    x, y = pad.size
    out = mounting.largest_bulge(plates_of(spec).elastomer, press)
    assert 2 / 3 * out * 2 * (x + y) * (pad.thickness - press) == approx(x * y * press, rel=1e-6)
    assert mounting.largest_bulge(plates_of(spec).elastomer, 0.0) == 0.0


@pytest.mark.slow
def test_thick_pin_and_narrow_shaft_are_found_without_solids():
    import sitscad
    from sitscad.spec import templates

    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml")

    def rules(changed):
        findings = {f.rule: f for f in sitscad.check(changed, hints="none").findings}
        return {rule: findings[rule] for rule in ("SIT324", "SIT325") if rule in findings}

    assert rules(spec) == {}
    thick = rules(spec.replace("assembly.hinge_pin", "2 mm"))
    assert set(thick) == {"SIT324"} and thick["SIT324"].measured == approx(0.87e-3, abs=0.1e-3)
    narrow = rules(spec.replace("assembly.shaft_bore", "2.4 mm"))
    assert set(narrow) == {"SIT325"} and narrow["SIT325"].measured == approx(2.518e-3, abs=1e-5)
    silent = {each.rule: each.case for each in sitscad.check(spec, hints="none").not_checked}
    assert all(silent[f"SIT32{k}"] == "on-solids" for k in range(4))


@pytest.mark.slow
def test_build_reports_measured_faults(hinged, pieces):
    import json

    import sitscad
    from sitscad.checks.policy import Policy
    from sitscad.package.stages import package_contents
    from sitscad.spec import templates

    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml")
    contents = package_contents(Design(spec), Policy(), None)
    post = Solid("post", box(-1e-3, 2.8e-3, -1e-4, 1e-3, 2.9e-3, 0.0), "steel", "#000000", BodyRole.MOUNT)
    text = json.dumps(mounting.fit_document(measure_solids(hinged, (*pieces, post))))
    before, after = contents.checked, replace(contents, measured=text).checked
    assert "SIT321" in {each.rule for each in before.not_checked} - {each.rule for each in after.not_checked}
    assert [f.rule for f in after.findings if f not in before.findings] == ["SIT321"] and not after.ok


def test_sensor_without_jaw_has_no_proof():
    layout = handmade.bench_sensor()
    assert measure_solids(layout, whole(layout)) is None


def red_of(clash):
    """The volume (mm3) behind the cut that is drawn as too much, and the names of what clashes."""
    shown = {each.name: each for each in clash.bodies if each.clashes}
    red = manifold(TriangleMesh("red", shown["too much"].vertices, shown["too much"].triangles))
    return red.volume(), set(shown)


def test_overlap_is_shown_cut_open_in_red(hinged, pieces):
    post = Solid("post", box(-2e-3, 1e-3, 0.3e-3, 0.0, 2e-3, 0.5e-3), "steel", "#000000", BodyRole.MOUNT)
    around = (*(s for s in pieces if s.role is not BodyRole.ENCAPSULATION), post)
    drawn = clashes(hinged, around, measure_solids(hinged, around), ())
    (clash,) = [each for each in drawn if each.title == "elastomer and post"]
    volume, names = red_of(clash)
    whole_post = 1e9 * shared_volume(around[-1], next(s for s in around if s.name == "elastomer"))
    assert volume == approx(whole_post / 2, rel=1e-6) and names == {"elastomer", "too much"}
    assert clash.excess_text == f"both take {whole_post:.3g} mm3"


def test_glue_overlapping_mount_is_shown(hinged, pieces):
    """The jaw's own STEP file took the glue under the shield; the picture of it ended every build."""
    line, block = box(5e-3, 0.0, 9e-3, 7e-3, 1e-3, 9.05e-3), box(6e-3, 0.0, 8e-3, 8e-3, 1e-3, 10e-3)
    around = (*pieces, Solid("glue-shield", line, "adhesive", "#d9b26a", BodyRole.GLUE),
              Solid("post", block, "steel", "#000000", BodyRole.MOUNT))
    drawn = clashes(hinged, around, measure_solids(hinged, around), ())
    assert {"glue-shield and post", "post and glue-shield"} & {clash.title for clash in drawn}


@pytest.mark.more
@pytest.mark.slow
def test_excess_beyond_port_is_shown_with_circle(hinged, pieces):
    post = Solid("post", box(-1e-3, 2.8e-3, -1e-4, 1e-3, 2.9e-3, 0.0), "steel", "#000000", BodyRole.MOUNT)
    (clash,) = clashes(hinged, (*pieces, post), measure_solids(hinged, (*pieces, post)), ())
    volume, names = red_of(clash)
    assert clash.port[3] == 2.75 and names == {"too much"}
    assert volume == approx(0.01, rel=1e-6), "half of the post, which lies outside as a whole"
    text = clash_svg("s", [clash])
    assert text == clash_svg("s", [clash]) and "the closed pair and its port" in text and "#d00000" in text
    words = re.findall(r"<text[^>]*>([^<]*)<", text)
    assert words[0] == "s: what does not fit, the solids cut open" and {"x", "y", "z"} <= set(words)
    assert any(re.fullmatch(r"post reaches [\d.]+ mm from the axis, [\d.]+ um farther than the port \(2.75 mm\)", w)
               for w in words), words
    scale = next(float(w.split(" mm")[0]) for w in words if w.endswith("along each axis"))
    assert scale in (0.2, 0.5, 1.0, 2.0, 5.0)


@pytest.mark.slow
def test_clashes_show_opened_jaws_and_loaded_pads(hinged, pieces):
    top = max(s.shape.bounding_box().max.Z for s in pieces) * 1e-3
    post = Solid("post", box(-7e-3, -1e-3, top + 1e-3, -6e-3, 1e-3, top + 2e-3), "steel", "#000000", BodyRole.MOUNT)
    (opened,) = [
        c for c in clashes(hinged, (*pieces, post), measure_solids(hinged, (*pieces, post)), ()) if "open by" in c.title
    ]
    assert red_of(opened)[0] > 0.0
    wall = Solid("wall", box(-5e-3, 2.2e-3, 0.1e-3, 5e-3, 2.3e-3, 0.4e-3), "steel", "#000000", BodyRole.MOUNT)
    around = (*(s for s in pieces if s.role is not BodyRole.ENCAPSULATION), wall)
    much = PadLoad("much", Pose(z=-0.05e-3), 0.5e-3)
    (bulging,) = [c for c in clashes(hinged, around, measure_solids(hinged, around, (much,)), (much,))
                  if "much" in c.title]
    assert "elastomer" in bulging.title and red_of(bulging)[0] > 0.0
