"""How thick pad and target are with which the inductance changes most per newton: held against estimates of such."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from tolerance import approx

import sitscad
from sitscad.estimates.signal import most_signal, signals
from sitscad.fixes.pads import best_thickness
from sitscad.inspection import as_configured
from sitscad.report import numbers

TEMPLATES = Path(__file__).parents[2] / "templates"


def _design(name):
    return sitscad.Design(sitscad.load(TEMPLATES / f"{name}.yaml"))


@pytest.fixture(scope="module")
def bench():
    return _design("bench_7mm")


def _as_thick(spec, part, thickness):
    key = {"pad": "elastomer", "target": "target"}[part]
    return sitscad.Design(replace(spec, **{key: replace(getattr(spec, key), thickness=thickness)}))


def _per_newton(design):
    return max(abs(one.per_newton) for one in signals(design.estimates))


def test_what_is_named_is_what_estimates_of_it_say_and_no_other_pad_gives_more(bench):
    """Nothing said it but a hint, with --hints full, of sensors that hardly feel anything."""
    pad, target = bench.most_signal
    assert (pad.part, target.part, pad.ended_by) == ("pad", "target", "")
    for one in (pad, target):
        assert -one.per_newton == approx(_per_newton(_as_thick(bench.spec, one.part, one.thickness)), rel=0.03)
        assert -one.per_newton_now == approx(_per_newton(bench), rel=1e-9)
        assert abs(one.per_newton) > abs(one.per_newton_now)
    assert round(pad.thickness / 0.05e-3) == approx(pad.thickness / 0.05e-3, rel=1e-9), "as people write it"
    for other in (0.7, 1.3):
        assert _per_newton(_as_thick(bench.spec, "pad", other * pad.thickness)) < -pad.per_newton


def test_parts_stay_within_the_port():
    design = _design("grasper_4layer")
    pad, target = design.most_signal
    assert pad.ended_by == target.ended_by == "the port"
    for thicker, fits in ((0.0, True), (0.05e-3, False)):
        closed = _as_thick(design.spec, "pad", pad.thickness + thicker).fit[0]
        assert closed.name == "closed pair" and (closed.likely_margin >= 0.0) is fits


def test_nothing_is_said_where_there_is_no_signal():
    design = _design("single_coil")
    assert most_signal(design.layout, design.estimates) == ()


def test_text_and_json_have_it(bench):
    checked = as_configured(bench.spec, sitscad.check(bench.spec, bench.layout, bench.estimates))
    text = numbers.as_text("a.yaml", bench.estimates, checked, most=bench.most_signal)
    (line,) = (line for line in text.splitlines() if line.startswith("  pad "))
    pad = bench.most_signal[0]
    assert f"{1e3 * pad.thickness:.4g} mm" in line and f"{1e9 * pad.per_newton:.3g} nH/N" in line
    document = json.loads(numbers.as_json("a.yaml", bench.estimates, checked, most=bench.most_signal))
    assert [row["part"] for row in document["most_signal"]] == ["pad", "target"]
    assert document["most_signal"][0]["thickness_m"] == pad.thickness


def test_of_cells_it_is_of_the_one_with_the_least_signal_and_says_so():
    """It was of C1, at a corner, where webs hold the middle one's pad stiffer; "-" stood for what ends it."""
    text = (TEMPLATES / "skin_grid_3x3.yaml").read_text(encoding="utf-8").replace("cells:", "cells:\n  web: 2 mm")
    skin = sitscad.Design(sitscad.load_text(text))
    pad, _ = skin.most_signal
    weakest = min(signals(skin.estimates), key=lambda one: abs(one.per_newton))
    assert (pad.cell, pad.coil, pad.per_newton_now) == (5, weakest.coil, weakest.per_newton)
    shown = numbers.as_text("a.yaml", skin.estimates, as_configured(skin.spec, sitscad.check(skin.spec, hints="none")),
                            most=skin.most_signal)
    assert "Most signal per newton of C5 (cell 5, of least signal)" in shown
    assert re.search(r"^  pad .* nothing: thicker gives no more$", shown, re.MULTILINE)


class _EveryThickerPadIsBetter:
    # As where the spec breaks its port already: no rule fails that had not failed.
    def __call__(self, fix):
        return ()

    def share(self, spec):
        return spec.elastomer.thickness

    def wants_another(self):
        return True


def test_a_hint_offers_no_pad_that_does_not_pass_the_port(bench):
    thickest = best_thickness(bench.spec, _EveryThickerPadIsBetter(), lambda spec: spec.elastomer.thickness < 3.1e-3)
    assert thickest.startswith("elastomer.thickness: 3 ")
    assert best_thickness(bench.spec, _EveryThickerPadIsBetter(), lambda spec: False) == ""
