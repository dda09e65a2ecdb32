"""Every bend of a tail is in one list, and all papers say that list."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import pytest
from tolerance import approx

from sitscad.assembly.places.tail_path import (
    bends,
    bends_of_mount,
    free_tail_start,
    lip,
    pivot_line,
    stated_bend,
    tail_path,
)
from sitscad.checks.board.tail import RULES
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.files.documents.drawings import board_drawing
from sitscad.files.drawing.sheet import Label, flat_items
from sitscad.files.formats.kicad.project_files import board_text as kicad_board
from sitscad.files.order_facts.notes import bend_text, bent_text
from sitscad.layout import lay_out
from sitscad.layout.bending import bend_stretch, least_bend_radius
from sitscad.spec import templates
from sitscad.spec.load import load_text

TEMPLATES = [name for name in templates.names() if name != "single_coil"]
"""All that have a tail."""


def laid(name, *changes):
    text = templates.read(name)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return lay_out(load_text(text, f"{name}.yaml"))


@pytest.mark.parametrize("name", TEMPLATES)
def test_bends_lie_on_straight_tracks_with_minimum_radius(name):
    layout = laid(name)
    result, (low, high), least = bends(layout), bend_stretch(layout), least_bend_radius(layout.spec.fpc)
    assert result
    for bend in result:
        assert low - 1e-9 <= bend.start < bend.end <= high + 1e-9 and bend.radius >= least - 1e-12
    assert all(item.end <= other.start + 1e-9 for item, other in pairwise(result))
    edge = lip(layout)
    assert edge is None or edge.radius >= least - 1e-12


@pytest.mark.parametrize("name", TEMPLATES)
def test_solids_bend_at_listed_bends(name):
    layout = laid(name)
    here, turned = layout.body[2], []
    for stretch in tail_path(layout).stretches:
        if stretch.turn:
            turned.append((here, here + stretch.length, abs(stretch.turn)))
        here += stretch.length
    assert turned == [(bend.start, bend.end, bend.angle) for bend in bends_of_mount(layout)]


@pytest.mark.parametrize("name", ["fingertip_foil", "grasper_4layer", "jaw_5x20", "bench_7mm"])
def test_documents_name_all_bends(name):
    """The S of a grasper's tail stood in STEP and jaw drawing alone, and the cap's lip nowhere."""
    layout = laid(name)
    drawing = " ".join(i.text for i in flat_items(board_drawing.board_sheet(layout, "").items) if isinstance(i, Label))
    for words in (bend_text(bend_stretch(layout), bends(layout), pivot_line(layout)), bent_text(layout), drawing,
                  kicad_board(layout)):
        for bend in bends(layout):
            assert f"{bend.angle_text} {bend.direction}" in words


def test_mount_bend_angle_is_rounded_and_spec_angle_is_exact():
    *mounts, own = bends(laid("jaw_5x20", ("bend: static", "bend: {kind: static, angle: 22.5 deg}")))
    assert [re.findall(r"\d+\.\d", bend.angle_text) for bend in mounts] == [[], []]
    assert own.angle_text.startswith("22.5 ")


def test_cap_lip_has_tail_bend_radius():
    """Readme and drawing asked for 1.16 mm, the cap's lip had 0.5 mm."""
    layout = laid("fingertip_foil")
    down, up = bends(layout)
    edge = lip(layout)
    assert (down.direction, up.direction) == ("down", "up") and stated_bend(layout) is None
    assert edge.radius == down.radius == least_bend_radius(layout.spec.fpc)
    assert edge.start == approx(down.start, rel=1e-9)
    end = tail_path(layout).at(up.end - layout.body[2])
    assert end.angle == approx(0.0, abs=1e-9)
    assert tail_path(layout).start.z - end.z == approx(layout.spec.mount.standoff, rel=0.05)


def test_downward_bend_lies_beyond_bench_plate():
    layout = laid("bench_7mm", ("length: 30", "length: 16"))
    assert stated_bend(layout).start >= free_tail_start(layout) - 1e-9


def said(layout):
    return apply_rule(RULES[0], Design(layout.spec, layout))[0]


def test_tail_too_short_for_descent_yields_finding():
    layout = laid("fingertip_foil", ("standoff: 1.2", "standoff: 9"), ("length: 40", "length: 16"))
    assert "fpc.tail.length" in {finding.key for finding in said(layout) if finding.rule == "SIT123"}


def test_jaw_without_hinge_has_only_mount_bends():
    """90 degrees were ordered 27 mm behind the heel, within the tube."""
    layout = laid("grasper_4layer", ("jaw: generic-5mm ", "jaw: {width: 4.8, length: 20, height: 1.3} "))
    assert stated_bend(layout) is None and bends(layout) == bends_of_mount(layout)
    text = [item.partition(": ") for item in layout.spec.source.defaults if item.startswith("fpc.tail.bend")]
    assert ("fpc.tail.bend.angle", "0 deg down") in [(key, value.partition(",")[0]) for key, _, value in text]
    assert len({key for key, _, _ in text}) == len(text), "one line a key"
    assert stated_bend(laid("grasper_4layer")).angle == approx(math.radians(30.0), rel=1e-9)
