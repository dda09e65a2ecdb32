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
    assert best_thickness(bench, _EveryThickerPadIsBetter(), lambda spec: False) == ""
