"""Designs a minute at the screen level, by template and part, beside what the full level takes.

    python tests/benchmarks/screening.py [--designs 60] [TEMPLATE...]

Every design has another track and diameter, evaluated in chunks as by sweeps and studies; processor time of one
thread, warm, of the quickest chunk of five. Two cores make twice as many a minute. How far the figures are off is
printed by tests/validation/screen_level.py. It fails on nothing: it measures.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from sitscad.apps.study.evaluating import Chunk, evaluate_chunk, evaluate_design, measure_values
from sitscad.apps.study.evaluation import SCREEN
from sitscad.apps.study.measures import MEASURES
from sitscad.apps.study.space import Base
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import Design
from sitscad.estimates.windings.losses import SCREENING
from sitscad.layout import sketch
from sitscad.spec import templates

TEMPLATES = ("single_coil", "grasper_4layer", "bench_7mm", "three_axis_triangle", "robotic_jaw_12mm", "grasper_3p5mm")
NAMES = ("rp", "frequency", "resolution.normal", "fit.closed_pair")


ROWS = 5


def timed(work: Callable[[Any], Any], many: list[Any]) -> tuple[list[Any], float]:
    """What work makes of each, and the milliseconds of processor time that one takes: the least of five rows of them,
    which other programs disturb least.
    """
    result, least, size = [], math.inf, -(-len(many) // ROWS)
    for first in range(0, len(many), size):
        part = many[first : first + size]
        began = time.process_time()
        result += map(work, part)
        least = min(least, (time.process_time() - began) / len(part) * 1e3)
    return result, least


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("templates", nargs="*", default=TEMPLATES)
    parser.add_argument("--designs", type=int, default=60)
    request = parser.parse_args()
    print("| template | spec | sketch | estimates | figures | rules | whole | a minute on two | full |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in request.templates:
        base = Base(templates.read(name), f"{name}.yaml")
        coil = base.spec.coil
        changes = [(("coil.trace_width", f"{(coil.trace_width - k * 0.05e-6) * 1e6:.2f} um"),
                    ("coil.outer_diameter", f"{(coil.outer_diameter - k * 1e-6) * 1e3:.3f} mm"))
                   for k in range(request.designs)]
        evaluate_chunk(base, Chunk(tuple(changes[:2]), NAMES, SCREEN))
        size = max(1, request.designs // 2 // ROWS)
        chunks = [Chunk(tuple(changes[2 + 2 * k * size : 2 + 2 * (k + 1) * size : 2]), NAMES, SCREEN)
                  for k in range(ROWS)]
        _, whole = timed(lambda one, base=base: evaluate_chunk(base, one), chunks)
        whole /= size
        specs, of_spec = timed(base.design, changes[3::2])
        layouts, of_sketch = timed(sketch, specs)
        estimates, of_estimates = timed(lambda one: estimate_layout(one, tolerance=SCREENING), layouts)
        designs = [Design(one.spec, one, other) for one, other in zip(layouts, estimates, strict=True)]
        _, of_figures = timed(lambda one: measure_values(one, NAMES), designs)
        _, in_full = timed(lambda spec: evaluate_design(spec, NAMES), specs[:1])
        rest = whole - of_spec - of_sketch - of_estimates - of_figures
        print(f"| {name} | {of_spec:.1f} | {of_sketch:.1f} | {of_estimates:.1f} | {of_figures:.1f} | {rest:.1f} "
              f"| {whole:.1f} ms | {2 * 60e3 / whole:.0f} | {in_full:.0f} |")


if __name__ == "__main__":
    assert set(NAMES) <= set(MEASURES)
    main()
