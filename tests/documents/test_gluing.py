"""Glue by amount, time and weight: what the steps say is what the pad's law and the liquid's flow give."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import handmade
import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.assembly.places.bodies import BodyRole, plates_of
from sitscad.assembly.places.column import Toleranced
from sitscad.assembly.places.tail_path import bends, lip
from sitscad.assembly.solids.tooling import FOOT_ROOM, PEG, foot_pockets, push_places, skin_silicone
from sitscad.estimates import estimate
from sitscad.estimates.design import Design
from sitscad.estimates.loads import gluing as physics
from sitscad.estimates.loads.pad import loaded_poses
from sitscad.files.documents import gluing
from sitscad.files.documents.mounting import board_mounting_steps, jaw_joint_steps, release_text
from sitscad.files.documents.parts_list import items
from sitscad.files.documents.tail_steps import loose_tail_text, strain_relief_text
from sitscad.files.order_facts.notes import bend_place
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point, bounding_box
from sitscad.spec import presets, templates

HERE = Point(0.0, 0.0)


def spec_of(name, **changes):
    return sitscad.load_text(templates.read(name), "t.yaml").replace(changes)


def test_spreading_time_follows_stefan_law_and_torsion_constant():
    glue, force, line = presets.adhesive("cyanoacrylate"), 0.5, 30e-6
    disc, square = Footprint(True, (10e-3, 10e-3), HERE), Footprint(False, (10e-3, 10e-3), HERE)
    flows = [physics.spreading_time(glue, plan, force, line, 2.0) - 2.0 - physics.SPREADING * plan.area
             for plan in (disc, square)]
    assert flows[0] == approx(3.0 * math.pi * glue.viscosity * 5e-3**4 / (4.0 * force * line**2), rel=1e-9)
    assert flows[1] / flows[0] == approx(0.1406 * 10e-3**4 / (math.pi * 5e-3**4 / 2.0), rel=2e-3)
    strip = Footprint(False, (1.0, 1e-3), HERE)  # J = b h^3 / 3 of a thin one
    flow = physics.spreading_time(glue, strip, force, line, 0.0) - physics.SPREADING * strip.area
    assert flow == approx(3.0 * glue.viscosity * 1e-9 / 3.0 / (2.0 * force * line**2), rel=1e-3)
    assert physics.spreading_time(presets.adhesive("transfer-tape"), disc, force, line, 2.0) == 0.0


@pytest.mark.parametrize("name", ["grasper_4layer", "round_button_12mm", "fingertip_foil", "grasper_3p5mm"])
def test_press_weight_compresses_pad_by_stated_amount(name):
    spec = replace(spec_of(name), encapsulation=None)
    press = physics.piece_press(spec, "target")
    (pose,), _ = loaded_poses(spec, np.array([[press.force, 0.0, 0.0]]), np.array([True]))
    assert press.travel == approx(-float(pose[2]), rel=1e-3)
    least = physics.pad_compression(physics.unsealed_pad(spec), physics.LEAST_MASS * physics.STANDARD_GRAVITY)
    assert press.travel <= 1.1 * max(physics.PIECE_STRAIN * spec.elastomer.thickness, least)
    message = gluing.gluing_text(spec, "target", "the elastomer", Toleranced(1e-3), "")
    (mass,) = re.findall(r"together have ([0-9.]+) g", message)
    (travel,) = re.findall(r"presses the pad by ([0-9.]+) mm, which comes back", message)
    assert (float(mass), float(travel)) == approx((1e3 * press.mass, 1e3 * press.travel), rel=0.06)
    (volume,) = re.findall(r"Spread ([0-9.]+) mm3", message)
    assert float(volume) == approx(1e9 * spec.assembly.glue_line * physics.glued_area(spec, "target"), rel=0.05)


@pytest.mark.parametrize("mass", [5e-3, 45e-3, 67e-3, 0.18, 0.53, 1.4, 2.1])
def test_heavy_press_load_is_steel_bar_instead_of_washers(mass):
    """530 g were 85 washers, 17 cm of them on a peg of 15 mm."""
    diameter, height = PEG
    count, bar = gluing.washer_count(mass), gluing.steel_weight_size(mass)
    assert (count is None) == (mass > 50e-3)
    if count is not None:
        assert count * gluing.WASHER_HEIGHT <= height and count * gluing.WASHER_MASS + gluing.PRESS_MASS >= mass
        assert f"{count * 1e3 * gluing.WASHER_MASS:.0f}" and "washers" in gluing.loading_text("elastomer", mass)
        return
    across, high = bar
    ring = math.pi / 4.0 * (across**2 - gluing.BAR_HOLE**2)
    assert diameter < gluing.BAR_HOLE and high <= 2.0 * across
    assert ring * high * 7850.0 + gluing.PRESS_MASS == approx(mass, rel=1e-6)
    message = gluing.loading_text("elastomer", mass)
    # a heavier press needs a lower bar: of 630 g, a bar of 42 mm alone had 629 g, and the press 20 g
    (less,) = re.findall(r"\(([\d.]+) mm less for each gram", message)
    assert ring * (high - 18.0 * float(less) * 1e-3) * 7850.0 + 20e-3 == approx(mass, abs=0, rel=0.01)
    assert "washers" not in message and f"{1e3 * across:g} mm" in message and gluing.mass_text(mass) in message


def test_press_on_target_without_pad_has_no_travel():
    press = physics.piece_press(spec_of("bench_7mm", elastomer=None, requirements=None), "target")
    assert press.mass >= physics.LEAST_MASS and press.travel == 0.0


@pytest.mark.parametrize(("name", "own", "used"), [
    ("skin_grid_3x3", "cyanoacrylate", "epoxy"), ("round_button_12mm", "cyanoacrylate", "epoxy"),
    ("grasper_4layer", "cyanoacrylate", "epoxy"), ("bench_7mm", "silicone-adhesive", "silicone-adhesive"),
    ("bench_7mm", "transfer-tape", "transfer-tape"),
])
def test_board_glue_is_replaced_if_stated_glue_sets_too_fast(name, own, used):
    """Boards of 1 to 21 cm2 had an instant glue, of which some seconds are left once a board lies in its place."""
    changes = {"elastomer": None, "requirements": None} if own == "transfer-tape" else {}
    spec = spec_of(name, **changes).replace("assembly.adhesive", own)
    layout = sitscad.lay_out(spec)
    glue = physics.hard_adhesive(layout)
    assert glue.name == used
    if layout.spec.jaw is None:
        message, (_, area) = " ".join(board_mounting_steps(layout)), physics.board_plan(layout)
        assert (f"Not {spec.assembly.adhesive.product}" in message) == (used != own) and glue.product in message
        for volume in re.findall(r"Spread ([0-9.]+) mm3", message):
            assert float(volume) == approx(1e9 * area * spec.assembly.glue_line, rel=0.05)
        height = layout.spec.mount.standoff + spec.assembly.glue_line + layout.spec.fpc.stackup.thickness
        assert f"to the board's top face are {1e3 * height:.3f} +-" in message


@pytest.mark.cad
def test_glue_solids_have_material_and_volume_of_steps():
    """The board's line was weighed as the pads' glue, and drawn thinner than the steps had it."""
    spec = spec_of("three_axis_triangle")
    design = sitscad.design_of(spec) if hasattr(sitscad, "design_of") else Design(spec)
    lines = {each.name: each for each in design.solids.whole if each.role is BodyRole.GLUE}
    assert lines["glue-board"].material == "epoxy"
    assert {lines[f"glue-{part}"].material for part in ("elastomer", "target")} == {"cyanoacrylate"}
    (volume,) = re.findall(r"Spread ([0-9.]+) mm3", " ".join(board_mounting_steps(design.layout)))
    assert lines["glue-board"].volume * 1e9 == approx(float(volume), rel=0.05)


@pytest.mark.parametrize("name", ["skin_grid_3x3", "skin_strip_6", "round_button_12mm", "grasper_4layer"])
def test_board_press_spreads_glue_within_open_time(name):
    layout = sitscad.lay_out(spec_of(name))
    mass, glue, (plan, area) = physics.board_press(layout), physics.hard_adhesive(layout), physics.board_plan(layout)
    takes = physics.spreading_time(glue, plan, mass * physics.STANDARD_GRAVITY, layout.spec.assembly.glue_line,
                                   physics.HARD_HANDLING)
    assert takes <= glue.open_time
    assert mass * physics.STANDARD_GRAVITY >= 0.95 * physics.HARD_PRESSURE * area
    message = gluing.pressing_text(layout, "")
    assert "jig-board-press" in message and gluing.mass_text(mass) in message
    text = release_text(push_places(layout.body, layout.body_outline), skin_silicone(layout))
    assert ("holes in turn" in text) == (len(layout.spec.cell_placements) > 1)


def test_board_press_pocket_has_room_for_cast_film():
    change = {"encapsulation": {"thickness": "0.5 mm"}, "elastomer.size": "6 mm", "target.size": "6 mm"}
    layouts = [sitscad.lay_out(spec_of("three_axis_triangle", **each))
               for each in ({**change, "encapsulation": None}, change)]
    bare, cast = (bounding_box(foot_pockets(layout)) for layout in layouts)
    pad = plates_of(layouts[1].spec).elastomer.footprint.box
    assert cast[0] <= pad[0] - 0.5e-3 - FOOT_ROOM[0] + 1e-9 and cast[0] < bare[0]


def test_board_without_rim_is_pressed_through_foam():
    layout = sitscad.lay_out(spec_of("three_axis_triangle", **{"elastomer.size": "10 mm", "target.size": "10 mm"}))
    assert foot_pockets(layout) == ()
    message = gluing.pressing_text(layout, "Spread.")
    assert "jig-board-press" not in message and "foam" in message and "Clamp" in message


def test_height_measurement_states_compression_by_micrometer():
    for name in ("grasper_4layer", "grasper_3p5mm"):
        spec, message = spec_of(name), gluing.measuring_text(spec_of(name))
        is_soft = physics.pad_force(physics.unsealed_pad(spec), gluing.HEIGHT_ERROR) < gluing.LIGHT_GAUGE
        assert ("Do not use a dial gauge" in message) == is_soft
        (ratchet,) = re.findall(r"ratchet [^.]*presses the pad by ([0-9.]+) mm", message)
        assert float(ratchet) == approx(1e3 * physics.pad_compression(physics.unsealed_pad(spec), gluing.RATCHET),
                                        rel=0.06)
    assert gluing.measuring_text(handmade.bare().spec) == ""


@pytest.mark.parametrize(
    ("changes", "named"),
    [({}, "Loctite 770 is an amine"), ({"assembly.adhesive": "silicone-adhesive"}, "tin"),
     ({"encapsulation": None}, ""), ({"encapsulation.material": {"shear_modulus": "100 kPa"}}, ""),
     ({"assembly.adhesive": "transfer-tape"}, "")],
)
def test_cure_inhibition_of_film_is_stated_if_expected(changes, named):
    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace(changes)
    message = gluing.inhibition_warning(spec.assembly.adhesive, spec.encapsulation)
    assert (named in message and "24 h" in message) if named else message == ""


def test_free_tail_bend_uses_rod_of_twice_bend_radius():
    layout = sitscad.lay_out(spec_of("grasper_4layer"))
    (rod,) = re.findall(r"rod of ([0-9.]+) mm diameter", strain_relief_text(layout))
    radius = bends(layout)[0].radius
    assert 2e3 * radius <= float(rod) <= 2e3 * radius + 0.1


@pytest.mark.parametrize("name", ["jaw_5x20", "grasper_4layer", "robotic_jaw_12mm", "grasper_3p5mm"])
def test_bend_with_rod_inside_jaw_is_made_before_gluing(name):
    """The steps had the tail 0.7 mm above the jaw's face bent over a rod of 2.4 mm below it, once the board was on."""
    layout = sitscad.lay_out(spec_of(name))
    early, late = loose_tail_text(layout), strain_relief_text(layout)
    for bend in bends(layout):
        over_edge = lip(layout) is not None and bend.why
        step, other = (late, early) if over_edge else (early, late)
        place = bend_place(layout.body[2], bend)
        assert place in step and place not in other
        _, _, after = step.partition(place)
        rod = re.search(r"rod (under|over)", after.partition(". ")[0])
        assert (rod and rod[1]) == ("over" if bend.direction == "up" else None if over_edge else "under")


@pytest.mark.parametrize("kind", ["pins", "dovetail"])
def test_joint_cuts_in_jaw_have_stated_positions(kind):
    """Holes were "where the STEP file of the jaw has them"."""
    from sitscad.assembly.places.jaws import jaw_range
    from sitscad.assembly.places.seating import pin_places

    spec = sitscad.load_text(templates.read("grasper_4layer"), "t.yaml").replace(
        {"mount.retention": kind, "shield": None})
    layout = sitscad.lay_out(spec)
    message, tip = " ".join(jaw_joint_steps(layout.body, layout.spec.assembly.glue_line,
                                            layout.spec.mount)), jaw_range(layout.body, layout.spec.jaw)[0]
    assert f"{5e2 * layout.spec.jaw.width:.2f} mm from either side" in message
    for x, _ in pin_places(layout.body, layout.spec.mount):
        assert f"{1e3 * (x - tip):.2f}" in message
    assert kind == "pins" or re.search(r"from the tip [0-9]+\.[0-9]{2} mm long", message)


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.cad
def test_jig_pictures_show_pieces_of_each_step():
    from sitscad.assembly import solids as parts
    from sitscad.files.documents.mounting import render_jig_picture

    layout = sitscad.lay_out(spec_of("round_button_12mm"))
    solids, tools = parts.solids(layout), parts.assembly_aids(layout)
    contents = render_jig_picture(layout, solids, tools).values()
    first = ["jig-base", "board", "jig-elastomer", "elastomer", "jig-elastomer-press"]
    last = ["jig-base", "board", "elastomer", "jig-target", "target", "jig-target-press"]
    press = ["mount", "board", "elastomer", "target", "jig-board-press"]
    for content, shown in zip(contents, (first, last, press), strict=True):
        for view in ("exploded", "section"):
            assert re.findall(f"id='{view}-([a-z-]+)'", content.decode()) == shown
    alone = replace(layout, spec=replace(layout.spec, target=None))
    content, _ = render_jig_picture(alone, tuple(s for s in solids if s.role != "target"),
                                    parts.assembly_aids(alone)).values()
    assert "exploded-jig-elastomer-press" in content.decode() and "jig-target" not in content.decode()
    assert render_jig_picture(layout, solids, ()) == {}


def test_too_heavy_press_load_is_spring_clamp():
    """A bar of 80 mm and 164 mm high was asked for, on a board of 46 mm."""
    layout = sitscad.lay_out(spec_of("skin_grid_3x3"))
    mass = physics.board_press(layout)
    is_clamped, spring, pressing = gluing.is_clamped, gluing.spring_text, gluing.pressing_text
    assert is_clamped(mass) and not is_clamped(physics.board_press(sitscad.lay_out(spec_of("skin_strip_6"))))
    force = float(re.match(r"(\d+) N", spring(mass))[1])
    assert force == approx(mass * 9.80665, abs=0, rel=0.02)
    assert re.search(r"becomes ([\d.]+) mm", spring(mass))[1] == f"{force / 10.0:.2g}"
    parts = {item.item: item.size for item in items(layout, estimate(layout).readout)}
    assert spring(mass) in parts["jig clamp"] and gluing.mass_text(mass) not in parts.get("jig bar", "")
    assert spring(mass) in pressing(layout, "Spread.")


def test_webs_between_pads_get_no_glue():
    """The area of the dose is the pads', and the step did not say whether the webs are glued."""
    joined_spec = spec_of("skin_strip_6").replace("cells.web", "1 mm")
    message = gluing.gluing_text(joined_spec, "elastomer", "the board", Toleranced(1e-3), "")
    assert "the webs between them get none" in message
    assert "webs" not in gluing.gluing_text(spec_of("grasper_4layer"), "elastomer", "the board", Toleranced(1e-3), "")
