"""What webs add to a pad's stiffness, against finite elements of one web, and what it does to a pad's pose."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from tolerance import approx

from sitscad.kernels.mechanics.elastomer import Face, Surround
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.kernels.mechanics.pad_law import force_sigma
from sitscad.kernels.mechanics.surround_law import NO_WEBS, WEB_SIGMA, Webs, web_effect

FIGURES = Path(__file__).parents[1] / "validation" / "web_figures.csv"
ROWS = [{name: float(value) for name, value in row.items()}
        for row in csv.DictReader(FIGURES.read_text(encoding="utf-8").splitlines()[1:])]
MOST = {"press": 0.15, "shear": 0.3, "tilt": 0.16, "aside": 0.25}
"""By how much of what a web adds the law may be off; of little that it adds across itself by its double."""


def joined(row: dict[str, float], **webs: float) -> BondedPad:
    """The pad of a row in metres, with webs or the row's one."""
    size = [1e-3 * (row[name] - 2.0 * row["rim"]) for name in ("along", "across")]
    result = Webs(1e-3 * row["web"], **webs or {"right": web_effect(row["gap"])})
    return BondedPad(Face(*size), 1e-3, 60e3, surround=Surround(1e-3 * row["rim"], webs=result))


def without_webs(pad: BondedPad) -> BondedPad:
    return replace(pad, surround=replace(pad.surround, webs=NO_WEBS))


def test_web_stiffening_agrees_with_finite_elements():
    for row in ROWS:
        pad = joined(row)
        stiffer, aside = pad.block.web_stiffening, pad.block.turned.web_stiffening
        result = {"press": stiffer.press - 1.0, "shear": stiffer.shear - 1.0, "tilt": stiffer.tilt - 1.0,
                 "aside": stiffer.pressure_centre}
        for name, most in MOST.items():
            assert result[name] == approx(row[name], rel=most), (row, name)
        assert abs(aside.shear - 1.0 - row["side_shear"]) < 0.025 > abs(aside.tilt - 1.0 - row["side_tilt"])
        held, bare = (item.stiffness(np.zeros((1, 6)))[0] for item in (pad, without_webs(pad)))
        for axis, name in ((2, "press"), (0, "shear")):
            assert held[axis, axis] / bare[axis, axis] - 1.0 == approx(row[name], rel=MOST[name] + 0.01)


def test_web_at_one_side_causes_tilt_as_in_elements():
    """By the elements 0.33 % of a side's length beside the middle, for a tenth of the side: 17 rad/m of way."""
    row = ROWS[1]
    right, left, back = (joined(row, **{side: web_effect(row["gap"])}) for side in ("right", "left", "back"))
    loads = np.array([[0.5, 0.0, 0.0], [1.0, 0.05, -0.03]])
    tilted = right.pose(loads)
    assert tilted[0, 4] < 0.0 and tilted[0, [1, 3, 5]] == approx(0.0, abs=1e-12)
    given = np.column_stack([loads[:, 1:], -loads[:, 0], np.zeros((2, 3))])
    assert right.force(tilted) == approx(given, abs=1e-6)
    assert left.pose(loads[:1])[0] == approx(tilted[0] * [-1, 1, 1, 1, -1, 1], abs=1e-12)
    assert back.pose(loads[:1])[0, 3] == approx(-tilted[0, 4], rel=1e-6)
    small = right.pose(np.array([[0.01, 0.0, 0.0]]))[0]
    of_elements = row["aside"] * 1e-3 * (1.0 + row["press"]) / (1.0 + row["tilt"])
    bare = without_webs(right).stiffness(np.zeros((1, 6)))[0]
    assert small[4] / small[2] == approx(of_elements * bare[2, 2] / bare[4, 4], rel=0.1)
    level = right.pose(loads[:1], is_held=True)
    assert level[0, 3:] == approx(np.zeros(3), abs=0.0)
    assert right.force(level)[0, 4] / right.force(level)[0, 2] == approx(-row["aside"] * 1e-3, rel=0.1)


def test_webs_on_all_sides_stiffen_nearly_like_a_rim():
    """As long and as wide as the side, they leave out the corners of the pad that reaches as far on all sides."""
    pad = BondedPad(Face(8e-3, 8e-3), 1e-3, 60e3)
    webs = Webs(8e-3, *(4 * [web_effect(3.0)]))
    wide, held = (replace(pad, surround=around) for around in (Surround(3e-3), Surround(webs=webs)))
    more, most = (item.block.web_stiffening.press * item.pressure(np.array([0.0, 1e-4]))[1]
                  / item.block.web_stiffening.press
                  / pad.pressure(np.array([1e-4]))[0] - 1.0 for item in (held, wide))
    assert 0.6 * most < more < most


def test_stated_error_grows_with_web_stiffening():
    held = joined(ROWS[2])
    added = held.block.web_stiffening.press
    bare = force_sigma(without_webs(held).block)
    assert held.sigma == approx(np.hypot(bare, WEB_SIGMA * (1.0 - 1.0 / added)), rel=1e-12)
