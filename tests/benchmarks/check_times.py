"""What `sitscad check` costs: processor time and memory of whole commands over random designs of sensible proportions.

    python tests/benchmarks/check_times.py [-n 200] [--first 1] [--hints decisive] [-o FILE.csv]

Every design is checked in a process of its own, cold, as a person would, with the bytecode that an installed package
has. Times are of the processor (user and system) and are also given as multiples of what a process needs that only
imports numpy, which is measured again beside every design: a processor that others use, too, is slower for both. It
fails on nothing: it measures.

Every refused design is held against the passed one that is most like it in size. Designs of one size cost very unlike
amounts by themselves, so every passed design is held against another passed one in the same way, as a control: only
what the first row has beyond the second is the refusal's.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import random
import statistics
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import sitscad

SHAPES = ("circle", "circle", "circle", "square", "rectangle", "hexagon", "octagon", "racetrack")
PARTS = {"circle": 4, "square": 4, "rectangle": 4, "hexagon": 6, "octagon": 8, "racetrack": 2}
"""Turns are wound in such parts of one."""

LINES = {"generic-flex": 100, "generic-fine": 76, "huayue": 76, "osh-park-flex": 152, "weller": 100, "shipco": 127}
"""Fabricators, and tracks (um) that they make in most foils."""

METALS = ("copper", "copper", "aluminium", "brass")
PADS = ("ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10", "dragon-skin-30")


def design(seed: int) -> dict[str, object]:
    """A design that a person might ask for: to 8 layers, 30 turns a layer, 4 coils. Some pass, most are refused."""
    pick = random.Random(seed)
    coil, reach = _coil(pick)
    array, across = _array(pick, reach)
    document: dict[str, object] = {"sitscad": 1, "name": f"random-{seed}", "coil": coil, "array": array}
    document["fpc"] = _board(pick, coil, array)
    if pick.random() < 0.75:
        document |= _plates(pick, across)
    if "target" in document and pick.random() < 0.5:
        document |= _mount(pick)
    readout: dict[str, object] = {"capacitance": pick.choice(["auto", "auto", "100 pF", "220 pF", "330 pF"])}
    if pick.random() < 0.3:
        readout["scan_rate"] = f"{pick.choice([50, 250, 500, 1000])} Hz"
    return document | {"readout": readout}


def _coil(pick: random.Random) -> tuple[dict[str, object], tuple[float, float]]:
    """A coil whose turns leave a centre free, most of them; and its size (mm)."""
    shape = pick.choice(SHAPES)
    layers = pick.choice([1, 2, 2, 2, 2, 3, 4, 4, 6, 8])
    width = pick.choice([76, 100, 100, 120, 150])
    spacing = pick.choice([width, width, 76, 100])
    turns = round(math.exp(pick.uniform(math.log(3.0), math.log(30.0))) * PARTS[shape]) / PARTS[shape]
    inside = pick.uniform(0.1, 0.6)
    across = round(max(3.0, 2e-3 * turns * (width + spacing) / (1.0 - inside)), 2)
    size = (across, across)
    if shape in ("rectangle", "racetrack"):
        size = (round(across * pick.uniform(1.2, 2.5), 2), across)
    coil: dict[str, object] = {
        "shape": shape, "outer_diameter": across if size[0] == across else list(size), "turns": turns,
        "layers": layers, "trace_width": f"{width} um", "trace_spacing": f"{spacing} um",
    }
    if pick.random() < 0.3:
        coil["start_angle"] = f"{pick.choice([30, 45, 90, 135, 180, 250])} deg"
    if shape in ("square", "rectangle", "hexagon", "octagon") and pick.random() < 0.3:
        coil["corner_radius"] = round(pick.uniform(0.05, 0.2) * across, 2)
    return coil, size


def _array(pick: random.Random, reach: tuple[float, float]) -> tuple[dict[str, object], tuple[float, float]]:
    """One to four coils, and how far they reach together (mm)."""
    gap = pick.choice([0.2, 0.5, 1.0, 2.0])
    pattern = pick.choice(["single", "single", "line", "line", "line", "triangle", "grid"])
    pitch = round(max(reach) * (1.16 if pattern == "triangle" else 1.0) + gap, 2)
    if pattern == "single":
        return {"pattern": pattern}, reach
    if pattern == "line":
        count = pick.choice([2, 2, 3, 4])
        return {"pattern": pattern, "count": count, "pitch": pitch}, (reach[0] + (count - 1) * pitch, reach[1])
    across = (reach[0] + pitch, reach[1] + pitch)
    return {"pattern": pattern, "pitch": pitch} | ({"count": [2, 2]} if pattern == "grid" else {}), across


def _board(pick: random.Random, coil: dict[str, object], array: dict[str, object]) -> dict[str, object]:
    finest = min(float(str(coil[key]).split()[0]) for key in ("trace_width", "trace_spacing"))
    able = [name for name, least in LINES.items() if least <= finest] or ["generic-fine"]
    fpc: dict[str, object] = {"rules": pick.choice([*able, *able, *LINES])}
    if pick.random() < 0.7:
        fpc["tail"] = {
            "length": pick.choice([15, 30, 60]), "connector": "zif-0.5mm" if pick.random() < 0.8 else "zif-0.3mm",
            "layers": 2 if pick.random() < 0.85 else 1, "bend": pick.choice(["none", "static"]),
        }
    return fpc


def _plates(pick: random.Random, across: tuple[float, float]) -> dict[str, object]:
    """Target and pad about as large as the coils together."""
    size = [round(side * pick.uniform(0.8, 1.2), 2) for side in across]
    equal = abs(size[0] - size[1]) < 0.2 * size[1]
    shape = pick.choice(["square", "circle"]) if equal else "rectangle"

    def plate() -> dict[str, object]:
        return {"shape": shape, "size": size[0] if equal else list(size)}

    thickness = pick.choice([0.02, 0.1, 0.2, 0.5])
    pad = {"material": pick.choice(PADS), "thickness": pick.choice([0.5, 1.0, 1.5, 3.0])}
    force = round(pick.uniform(0.005, 0.15) * size[0] * size[1], 2)
    return {
        "target": {**plate(), "thickness": thickness, "material": pick.choice(METALS)},
        "elastomer": {**plate(), **pad},
        "requirements": {"normal_force": f"{force} N"},
    }


def _mount(pick: random.Random) -> dict[str, object]:
    standoff = pick.choice([0.7, 1.0, 1.5])
    if pick.random() < 0.7:
        return {"mount": {"kind": "bench-plate", "standoff": standoff}}
    return {"mount": {"kind": "grasper-pad", "jaw": "generic-5mm", "standoff": standoff}}


@dataclass(frozen=True)
class Cost:
    """What one check cost: processor time (s), that over `import numpy`, most memory (MB), and its verdict.

    `size` is what the design has of copper: all turns of all layers and coils; `shape` that of its coils.
    """

    seed: str
    outcome: str
    seconds: float
    numpies: float
    megabytes: float
    errors: str
    shape: str = ""
    size: float = 0.0


def measured(command: Sequence[str], limit: float = 900.0) -> tuple[int, float, float, str]:
    """Exit code, processor time (s), most memory (MB) and output of a command; cut off after so many seconds of it."""
    import resource

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 1))

    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[2])}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    with tempfile.TemporaryFile() as output:
        child = subprocess.Popen(command, stdout=output, stderr=output, env=environment, preexec_fn=limited)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read().decode("utf-8", "replace")
    return child.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0, text


class ImportNumpy:
    """Processor time (s) of a process that only imports numpy, as it was lately: the middle of the last few."""

    def __init__(self, repeats: int = 7) -> None:
        self._last = deque((self._once() for _ in range(repeats)), maxlen=repeats)

    def again(self) -> float:
        """The time after one more such process."""
        self._last.append(self._once())
        return self.seconds

    @property
    def seconds(self) -> float:
        """The time of now."""
        return statistics.median(self._last)

    @staticmethod
    def _once() -> float:
        return measured([sys.executable, "-c", "import numpy"])[1]


OUTCOMES = {0: "passed", 1: "refused", 2: "not read"}


def costs(files: Sequence[Path], numpy: ImportNumpy, options: Sequence[str]) -> Iterator[Cost]:
    """The cost of checking each file in a process of its own, the first of them twice: for the bytecode."""
    import re

    for path in files[:1]:
        measured([sys.executable, "-m", "sitscad", "check", *options, str(path)])
    for path in files:
        command = [sys.executable, "-m", "sitscad", "check", *options, str(path)]
        code, seconds, megabytes, text = measured(command)
        errors = " ".join(re.findall(r"(SIT\d+) error", text))
        times = seconds / numpy.again()
        yield Cost(path.stem, OUTCOMES.get(code, f"exit {code}"), seconds, times, megabytes, errors, *_size(path))


def _size(path: Path) -> tuple[str, float]:
    """Shape of the coils of a spec, and all their turns; nothing of one that cannot be read."""
    try:
        spec = sitscad.load(path)
    except sitscad.SpecError:
        return "", 0.0
    return spec.coil.shape, sum(spec.coil.layer_turns) * len(spec.array.placements)


def pairs(found: Sequence[Cost], outcome: str = "refused") -> list[tuple[Cost, Cost]]:
    """Every design of an outcome beside the other, passed one that is most like it: round or not, and in size within a
    factor of 1.6; without those that have no such partner.
    """
    matched = []
    for item in (cost for cost in found if cost.outcome == outcome and cost.size):
        equal = [c for c in found if c.outcome == "passed" and (c.shape == "circle") == (item.shape == "circle")]
        others = (c for c in equal if c is not item and c.size)
        near = min(others, key=lambda c: abs(math.log(c.size / item.size)), default=None)
        if near is not None and 1 / 1.6 < near.size / item.size < 1.6:
            matched.append((item, near))
    return matched


def pairs_table(found: Sequence[Cost]) -> str:
    """How many times as much as a passed design of its size a refused one costs, and beside it how many times as much
    as another passed one a passed one does: the distributions as Markdown.
    """
    lines = ["| over a passed design of its size | pairs | median | 75 % | 90 % | 95 % | largest |",
             "|---|---|---|---|---|---|---|"]
    for outcome, words in (("refused", "refused"), ("passed", "another passed one (control)")):
        matched = pairs(found, outcome)
        if matched:
            spread = quantiles([item.seconds / passed.seconds for item, passed in matched])
            lines.append(f"| {words} | {len(matched)} | " + " | ".join(f"{value:.2f}" for value in spread) + " |")
        else:
            lines.append(f"| {words} | 0 | | | | | |")
    return "\n".join(lines)


def quantiles(values: Sequence[float]) -> list[float]:
    """Median, 75 %, 90 %, 95 % and largest."""
    ranked = sorted(values)
    return [ranked[min(len(ranked) - 1, math.ceil(share * len(ranked)) - 1)] for share in (0.5, 0.75, 0.9, 0.95, 1.0)]


def table(found: Sequence[Cost]) -> str:
    """The distribution as a Markdown table: a row for all, and for each outcome."""
    lines = ["| designs | | number | median | 75 % | 90 % | 95 % | largest |", "|---|---|---|---|---|---|---|---|"]
    groups = {"all": list(found)} | {name: [c for c in found if c.outcome == name] for name in OUTCOMES.values()}
    for name, group in groups.items():
        for what, unit, digits in (("numpies", "x import numpy", 1), ("seconds", "s", 2), ("megabytes", "MB", 0)):
            if group:
                spread = " | ".join(f"{value:.{digits}f}" for value in quantiles([getattr(c, what) for c in group]))
                lines.append(f"| {name} | {unit} | {len(group)} | {spread} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the distribution, write every design's cost where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, help="specs to check instead of random ones")
    parser.add_argument("-n", type=int, default=200, help="how many designs")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--hints", help="what is searched for hints: none, decisive, full")
    parser.add_argument("-o", "--output", type=Path, help="a CSV file with every design's cost")
    chosen = parser.parse_args(arguments)
    numpy = ImportNumpy()
    print(f"import numpy: {numpy.seconds:.3f} s of the processor")
    result = []
    with tempfile.TemporaryDirectory() as folder:
        files = list(chosen.files)
        for seed in range(chosen.first, chosen.first + chosen.n) if not files else ():
            files.append(Path(folder) / f"{seed}.yaml")
            sections = (f"{key}: {json.dumps(value)}\n" for key, value in design(seed).items())
            files[-1].write_text("".join(sections), "utf-8")
        for cost in costs(files, numpy, ["--hints", chosen.hints] if chosen.hints else []):
            result.append(cost)
            print(f"{cost.seed:>5} {cost.outcome:<9} {cost.seconds:7.2f} s {cost.numpies:7.1f} x "
                  f"{cost.megabytes:6.0f} MB  {cost.errors}", flush=True)
    print(f"import numpy: {numpy.seconds:.3f} s of the processor at last")
    print(table(result))
    print(pairs_table(result))
    if chosen.output:
        with chosen.output.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(Cost)], lineterminator="\n")
            writer.writeheader()
            writer.writerows(asdict(cost) for cost in result)


if __name__ == "__main__":
    main()
