"""The screen level against the full one, over random designs of six templates: errors, ranks and verdicts.

    python tests/validation/screen_level.py [NUMBER] [--cache FILE]

judges so many designs of each template in full, adds them to the cache (a line of JSON a design, so that a later run
goes on with more), screens all that are cached anew, and prints a row a measure: half and 95 % of the errors and the
worst, relative, Spearman's rank correlation, and how often the worst is within what was stated. Then the rules that one
level decides otherwise than the other. It takes about a second of processor time a design.
"""

from __future__ import annotations

import argparse
import json
import random
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from sitscad.apps.study.evaluating import can_screen, evaluate_design, screen_designs
from sitscad.apps.study.evaluation import SCREEN, UNDRAWN, Evaluation, evaluation_from_json
from sitscad.apps.study.measures import MEASURES
from sitscad.spec.load import load, load_text, rewritten_spec
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec

TEMPLATES = ("single_coil", "grasper_4layer", "bench_7mm", "three_axis_triangle", "robotic_jaw_12mm", "grasper_3p5mm")
ROOT = Path(__file__).resolve().parents[2]
HELD_BACK = 0.12
"""Half the range of what is multiplied."""

NAMES = tuple(
    name for name, row in MEASURES.items() if SCREEN in row.levels and not name.startswith(("yield", "sigma."))
)


def drawn(template: str, number: int) -> SensorSpec | None:
    """The design of that number: sizes of a template times random factors; None where nobody can wind it."""
    chance = random.Random(f"{template} {number}")
    spec = load(ROOT / "templates" / f"{template}.yaml")
    coil = spec.coil

    def around(value: float, part: float, grain: float) -> float:
        return round(value * (1.0 + part * chance.uniform(-1.0, 1.0)) / grain) * grain

    fine = ("trace_width", "trace_spacing")
    um = {name: max(50, round(around(getattr(coil, name), 0.25, 5e-6) * 1e6)) for name in fine}
    changes = {
        "coil.outer_diameter": f"{around(0.94 * min(coil.size), 0.06, 1e-5) * 1e3:.2f} mm",
        "coil.turns": max(2.0, around(0.85 * coil.turns, 0.2, 0.25)),
        **{f"coil.{name}": f"{value} um" for name, value in um.items()},
    }
    if spec.elastomer is not None:
        changes["elastomer.thickness"] = f"{around(spec.elastomer.thickness, 0.4, 1e-5) * 1e3:.2f} mm"
    if spec.target is not None:
        changes["target.thickness"] = f"{around(spec.target.thickness, 0.4, 1e-5) * 1e3:.2f} mm"
        size = [round(around(side, HELD_BACK, 1e-5) * 1e3, 2) for side in spec.target.size]
        changes["target.size"] = size if spec.target.size[0] != spec.target.size[1] else size[0]
    if spec.mount is not None and spec.mount.standoff:  # no less: a shield fills it
        changes["mount.standoff"] = f"{spec.mount.standoff * 1e3 + round(0.2 * chance.random(), 2):.2f} mm"
    try:
        result = rewritten_spec(spec, changes.items())
    except SpecError:
        return None
    return result if can_screen(result) else None


def cached(cache: Path, count: int) -> list[tuple[str, str, Evaluation]]:
    """Template, text and full evaluation of so many designs of each template at least, those of the cache first."""
    rows = [json.loads(line) for line in cache.read_text().splitlines()] if cache.exists() else []
    have = Counter(row["template"] for row in rows)
    with cache.open("a") as file:
        for number in range(count):
            for template in TEMPLATES:
                if number < have[template]:
                    continue
                spec = drawn(template, number)
                row = {"template": template, "text": spec.source.text if spec else "",
                       "full": evaluate_design(spec, NAMES).as_json() if spec else None}
                file.write(json.dumps(row) + "\n")
                file.flush()
                rows.append(row)
    return [(row["template"], row["text"], evaluation_from_json(row["full"])) for row in rows
            if row["full"] is not None]


def ranks(one: np.ndarray, other: np.ndarray) -> float:
    """Spearman's rank correlation."""
    return float(spearmanr(one, other).statistic) if len(one) > 2 and np.ptp(one) and np.ptp(other) else float("nan")


def table(rows: list[tuple[str, Evaluation, Evaluation]]) -> list[str]:
    """A row a measure: number, median, 95 % and worst of the errors, ranks, share within what was stated."""
    message = [f"{'measure':28}{'n':>6}{'median':>9}{'95 %':>9}{'worst':>9}{'rank':>8}{'within':>8}"]
    for name in NAMES:
        pairs = [(full.values[name][0], *quick.values[name]) for _, full, quick in rows
                 if name in full.values and name in quick.values and not UNDRAWN & set(full.refused)]
        if not pairs:
            continue
        full, quick, error = np.array(pairs).T
        off = np.abs(quick - full) / np.maximum(np.abs(full), 1e-300)
        within = float(np.mean(np.abs(quick - full) <= error + 1e-9 * np.abs(full)))
        message.append(f"{name:28}{len(off):6}{np.median(off):9.4f}{np.quantile(off, 0.95):9.4f}{off.max():9.4f}"
                    f"{ranks(full, quick):8.3f}{within:8.3f}")
    return message


def differing(rows: list[tuple[str, Evaluation, Evaluation]]) -> tuple[Counter[str], int, int]:
    """Rules of which one level says what the other does not, how many were decided, and how many verdicts differ."""
    other: Counter[str] = Counter()
    decided = verdicts = 0
    for _, full, quick in rows:
        for part in ("refused", "warned"):
            item, two = set(getattr(full, part)), set(getattr(quick, part))
            other.update(f"{rule} {part}" for rule in (item ^ two) - set(quick.unknown) - set(full.unknown))
        decided += bool(quick.refused)
        verdicts += bool(quick.refused) and not full.refused
        verdicts += not quick.refused and bool(set(full.refused) - set(quick.unknown))
    return other, decided, verdicts


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("number", type=int, nargs="?", default=0)
    parser.add_argument("--cache", type=Path, default=Path("screen_level.jsonl"))
    parser.add_argument("--each", action="store_true", help="a table a template, too")
    request = parser.parse_args()
    known = cached(request.cache, request.number)
    rows = [(template, full, screen_designs([load_text(text)], NAMES)[0]) for template, text, full in known]
    for template in TEMPLATES if request.each else ():
        print(template, *table([row for row in rows if row[0] == template]), sep="\n")
    print(len(rows), "designs", *table(rows), sep="\n")
    other, decided, verdicts = differing(rows)
    print(f"refused by the screen {decided}, verdicts that differ {verdicts}; rules that differ:", dict(other))


if __name__ == "__main__":
    main()
