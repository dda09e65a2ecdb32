"""Random tails and bodies: every key of ``fpc.tail`` and ``fpc.body`` beside random arrays.

    python tests/fuzz/random_tails.py [--boards N] [--first N]

lays out and checks N boards and prints those that end in an exception, or that pass their check with an outline that
crosses itself or copper beyond it; at the end how many were refused and how many passed.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import sitscad

Document = dict[str, Any]
PASSED, REFUSED = "passed", "refused"


def board(seed: object) -> Document:
    """A spec as plain values."""
    pick = random.Random(f"tail {seed}")
    shape = pick.choice(("circle", "circle", "square", "hexagon"))
    across, layers = pick.choice((4, 5.5, 7)), pick.choice((2, 2, 2, 4))
    width = pick.choice((0.1, 0.15))
    turns = max(1, int((across / 2 - 0.9) / (2 * width)))
    coil = {"shape": shape, "outer_diameter": across, "turns": turns + pick.choice((0, 0.5)), "layers": layers,
            "trace_width": width, "trace_spacing": width}
    array, along, sideways = pick.choice((
        ({"pattern": "single"}, 1, 1), ({"count": 2}, 2, 1), ({"count": 3}, 3, 1), ({"count": 4}, 4, 1),
        ({"pattern": "triangle"}, 2, 2), ({"pattern": "grid", "count": [2, 2]}, 2, 2),
    ))
    coils = {"triangle": 3, "grid": 4}.get(str(array.get("pattern")), along)
    fpc: Document = {"tail": _tail(pick, coils, layers)}
    if pick.random() < 0.8:
        fpc["body"] = _body(pick, (along * (across + 0.7), sideways * (across + 0.7)))
    elif pick.random() < 0.5:
        fpc["margin"] = [round(pick.uniform(0, 5), 2), round(pick.uniform(0, 5), 2)]
    return {"sitscad": 1, "name": f"tail-{seed}", "coil": coil, "array": array, "fpc": fpc}


def _tail(pick: random.Random, coils: int, layers: int) -> Document:
    tail: Document = {"length": round(pick.uniform(1, 60), 1)}
    aside = pick.choice(("none", "turn", "turn", "offset", "offset", "offset"))
    if aside == "turn":
        tail["turn"] = pick.choice(("left", "right"))
    if aside == "offset" or pick.random() < 0.02:
        tail["offset"] = round(pick.choice((-1, 1)) * pick.choice((0.05, 1, 5, 30)) * pick.uniform(0.5, 1.5), 2)
    if pick.random() < 0.3:
        tail["turn_radius"] = round(pick.uniform(0.5, 10), 2)
    if pick.random() < 0.3:
        tail["connector"] = pick.choice(("solder-pads", "zif-0.3mm", "zif-0.5mm"))
    if pick.random() < 0.2:
        tail["contacts"] = 2 * coils + pick.choice((-1, 0, 1, 2, 2, 4, 10))
    if pick.random() < 0.2:
        tail["stiffener"] = pick.choice((0.1, 0.225, 0.4))
    if pick.random() < 0.2:
        tail["layers"] = pick.choice((1, 2, layers))
    bend = pick.choice(("left out", "left out", "none", "none", "static", "dynamic", "section"))
    if bend == "section":
        tail["bend"] = {"at": round(pick.uniform(1, 30), 1), "direction": pick.choice(("up", "down")),
                        "angle": f"{pick.choice((20, 90, 170))} deg"}
        if pick.random() < 0.5:
            tail["bend"]["radius"] = round(pick.uniform(0.2, 6), 2)
    elif bend != "left out":
        tail["bend"] = bend
    return tail


def _body(pick: random.Random, needed: tuple[float, float]) -> Document:
    """A body about as large as the coils need, or of any size."""
    factor = pick.choice((0.4, 1, 1.2, 1.2, 1.6, 3))
    size = [round(max(1.5, factor * each + pick.uniform(0, 4)), 2) for each in needed]
    if pick.random() < 0.3:
        size = [round(pick.uniform(2, 40), 2) for _ in size]
    shape = pick.choice(("circle", "rectangle", "rectangle", "rounded", "rounded"))
    body: Document = {"shape": shape, "size": max(size) if shape == "circle" or pick.random() < 0.3 else size}
    if shape == "rounded" and pick.random() < 0.7:
        body["corner_radius"] = round(pick.uniform(0.1, 0.6) * min(size), 2)
    return body


def judged(document: Document) -> str:
    """`PASSED` or `REFUSED`; raises AssertionError where a board that passed is none that can be made."""
    from shapely.geometry import Point, Polygon

    try:
        spec = sitscad.load_text(json.dumps(document), "tail.yaml")
    except sitscad.SpecError as error:
        assert error.findings, "refused without a finding"
        return REFUSED
    layout = sitscad.lay_out(spec)
    ring = [(point.x, point.y) for point in layout.outline.flattened(1e-6)]
    outline, result = Polygon(ring), sitscad.check(spec, layout, hints="none")
    grave = [finding for finding in result.findings if finding.severity == "error"]
    assert not layout.shortfalls or grave, "what found no room is no error"
    if any(finding.rule.startswith("SIT1") for finding in grave):
        return REFUSED
    assert outline.is_valid, "the outline crosses itself"
    for trace in layout.traces:
        assert all(outline.covers(Point(point.x, point.y)) for point in trace.path.flattened(1e-6)), "a track outside"
    return PASSED


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boards", type=int, default=800)
    parser.add_argument("--first", type=int, default=0)
    request = parser.parse_args()
    ends: Counter[str] = Counter()
    for seed in range(request.first, request.first + request.boards):
        document = board(seed)
        try:
            ends[judged(document)] += 1
        except Exception as error:
            ends["faults"] += 1
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(place.filename).name}:{place.lineno}"
            print(f"{seed}: {type(error).__name__} {error} ({where}): {json.dumps(document)}", flush=True)
    print(f"{ends.total()} boards, {ends[REFUSED]} refused, {ends[PASSED]} passed, {ends['faults']} faults")
    return 1 if ends["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
