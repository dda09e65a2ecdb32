"""The thickness of a pad that hints name is one with which the pair passes its port."""

from __future__ import annotations

from pathlib import Path

import sitscad
from sitscad.fixes.pads import best_thickness

BENCH = Path(__file__).parents[2] / "templates" / "bench_7mm.yaml"


class _EveryThickerPadIsBetter:
    # As where the spec breaks its port already: no rule fails that had not failed.
    def __call__(self, fix):
        return ()

    def warned(self, spec):
        return ""

    def share(self, spec):
        return spec.elastomer.thickness

    def wants_another(self):
        return True


def test_a_hint_offers_no_pad_that_does_not_pass_the_port():
    bench = sitscad.load(BENCH)
    thickest = best_thickness(bench, _EveryThickerPadIsBetter(), lambda spec: spec.elastomer.thickness < 3.1e-3)
    assert thickest.startswith("elastomer.thickness: 3 ")
    vain = best_thickness(bench, _EveryThickerPadIsBetter(), lambda spec: False)
    assert "elastomer.thickness" not in vain and "tried" in vain


class _OneStep(_EveryThickerPadIsBetter):
    """The signal is most at a thickness (m); little may be tried."""

    def __init__(self, best: float, is_long: bool = False) -> None:
        self.best, self.is_long = best, is_long

    def share(self, spec):
        return 1.0 / (1.0 + 400.0 * abs(spec.elastomer.thickness - self.best))

    def wants_another(self):
        return self.is_long


def test_the_way_to_a_better_thickness_is_named_even_where_little_may_be_tried():
    """A new user went the wrong way: only the long search said which way, and nothing below a fifth more."""
    bench = sitscad.load(BENCH).replace("elastomer.thickness", 1.3e-3)
    assert "elastomer.thickness: 1.2 " in best_thickness(bench, _OneStep(0.85e-3), lambda spec: True)
    assert "elastomer.thickness: 1.5 " in best_thickness(bench, _OneStep(2e-3), lambda spec: True)
    assert "elastomer.thickness: 0.8 " in best_thickness(bench, _OneStep(0.85e-3, True), lambda spec: True)
    nearly = best_thickness(bench, _OneStep(1.3e-3, True), lambda spec: True)
    assert "elastomer.thickness" not in nearly and "tried" in nearly
