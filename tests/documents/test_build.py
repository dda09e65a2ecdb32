"""Steps of the build, distances of the tail's own coverlay, and what the order says of the coverlay's registration."""

import re

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.files.documents import order_notes
from sitscad.files.order_facts.notes import step_text
from sitscad.layout.lamination import lamination_text
from sitscad.layout.tail.chips import chip_opening
from sitscad.spec import presets, templates

GRASPER = templates.read("grasper_4layer")
UM = 1e-6


def laid(*changes):
    text = GRASPER
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return sitscad.lay_out(sitscad.load_text(text, "t.yaml"))


@pytest.mark.parametrize(("stackup", "tail", "etched", "bonds", "laminations"), [
    ("flex-4l", 2, {3}, {"2 to 3"}, "two"), ("flex-6l", 2, {3, 4, 5}, {"2 to 3", "4 to 5"}, "two"),
    ("flex-6l", 4, {2, 3, 5}, {"2 to 3", "4 to 5"}, "three"),
    ("flex-6l", 6, {2, 3, 4, 5}, {"2 to 3", "4 to 5"}, "one"),
    ("flex-8l", 2, {3, 4, 5, 6, 7}, {"2 to 3", "4 to 5", "6 to 7"}, "two"), ("flex-4l", 4, {2, 3}, {"2 to 3"}, "one"),
])
def test_lamination_text_names_every_inner_etching_and_bond(stackup, tail, etched, bonds, laminations):
    text = lamination_text(laid(("flex-4l  ", f"{stackup}  "), ("layers: 2   ", f"layers: {tail}   ")))
    assert text.startswith(laminations)
    result = re.findall(r"copper ([\d, ]+) etched on", text)
    assert {int(number) for group in result for number in re.findall(r"\d+", group)} == etched
    assert set(re.findall(r"copper (\d to \d)[,)]", text)) == bonds
    if tail < len(presets.stackup(stackup).copper):
        assert f"copper {tail} etched, the tail's own coverlay laid" in text


@pytest.mark.slow
def test_holes_are_clear_of_tail_coverlay_by_registration():
    layout = laid()
    rules = layout.spec.fpc.rules
    gap = min(layout.lap_start - via.centre.x - via.drill / 2 for via in layout.vias if via.lowest is None)
    assert gap >= rules.coverlay_registration
    text = step_text(layout.spec.fpc, layout.vias, layout.lap_start)
    assert f"{gap / UM:.3g} um or more from the walls of holes" in text
    wide = laid(("rules: generic-fine", "rules: {name: wide, based_on: generic-fine, coverlay_lap: 0.45}"))
    (findings,) = [f for f in sitscad.check(wide.spec, wide, hints="none").findings if "hole-to-step" in f.cases]
    assert findings.limit == approx(0.6e-3, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("size", ["chip-0402", "chip-0603"])
def test_capacitor_openings_include_coverlay_registration(size):
    layout = laid(("capacitor_at: converter", f"capacitors_on_board: {size}"))
    rules, chip = layout.spec.fpc.rules, layout.spec.readout.chip
    beyond = chip_opening(rules, chip)
    assert beyond == approx(min(rules.coverlay_registration, (chip.pitch - chip.pad_along - rules.coverlay_web) / 2),
                            rel=1e-9)
    text = " ".join(order_notes.order_readme(layout).split())
    assert f"coverlay is open {beyond / UM:.4g} um beyond each pad and laid within 150 um" in text
    assert "coverlay within 150 um of the copper" in text
    assert not findings_of("SIT114", layout.spec, layout)


@pytest.mark.slow
@pytest.mark.parametrize("bend", ["static", "dynamic"])
def test_tail_tracks_are_narrow_only_near_contact_vias(bend):
    layout = laid(("connector: zif-0.5mm", "connector: zif-0.3mm"), ("bend: static", f"bend: {bend}"))
    assert not layout.shortfalls
    tail = [trace for trace in layout.traces if trace.role.value == "tail"]
    narrow = [trace for trace in tail if trace.width < 0.15e-3]
    assert narrow and max(trace.width for trace in tail) == approx(0.2e-3, rel=1e-9)
    first = min(via.centre.x for via in layout.vias if via.lowest is not None)
    assert min(point.x for trace in narrow for point in (trace.path.start, trace.path.end)) > first - 2e-3
    assert not [f for f in sitscad.check(layout.spec, layout, hints="none").findings
                if f.rule in ("SIT107", "SIT108", "SIT109", "SIT110", "SIT123") and f.severity.value != "note"]
