"""A study of random boards: which are routed, what the findings of the others are worth, and how long it takes.

    python tests/validation/random_boards.py [--boards N] [--first N] [--kicad N] [--resistance N] [-o FILE]

prints a table and writes one row a board. Every spec is drawn from a seed: all shapes, arrays, fabricators, tails, one
to eight layers. A board *has room* when it meets the closed-form rules of `has_room`, written here from the contract
and not taken from the layout. Where a finding names what is missing, that much is given to the dimension that it names,
as often as it asks, until the board is routed.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
sys.path.insert(0, str(Path(__file__).parents[2]))

from probe_spots import touched
from ruamel.yaml import YAML

import sitscad
from sitscad.checks.fixes.search import Budget
from sitscad.checks.rules import rule_outcomes
from sitscad.checks.trials import Trials
from sitscad.estimates.design import Design

SHAPES = ("circle", "circle", "square", "rectangle", "hexagon", "octagon", "racetrack")
PARTS = {"circle": 8, "square": 4, "rectangle": 4, "hexagon": 6, "octagon": 8, "racetrack": 2}
CHOSEN = ("SIT101", "SIT102", "SIT103", "SIT116")
PATIENCE = 6
"""How often a finding's advice is followed."""


@dataclass(frozen=True)
class Board:
    """A spec as plain values: what YAML holds."""

    values: dict[str, object]

    @property
    def text(self) -> str:
        return "\n".join(f"{key}: {json.dumps(value)}" for key, value in self.values.items()) + "\n"

    def load(self) -> sitscad.SensorSpec:
        return sitscad.load_text(self.text, "random.yaml")

    def changed(self, section: str, **values: object) -> Board:
        return Board({**self.values, section: {**self.values[section], **values}})


def board(seed: int) -> Board:
    """The board of a seed."""
    pick = random.Random(seed)
    rules, (width, spacing) = pick.choice(
        [
            ("generic-flex", (100, 100)),
            ("generic-flex", (120, 100)),
            ("generic-fine", (76, 76)),
            ("generic-fine", (100, 90)),
        ]
    )
    shape, layers = pick.choice(SHAPES), pick.choice([1, 2, 2, 2, 3, 4, 4, 5, 6, 7, 8])
    across = round(pick.uniform(3.0, 12.0), 2)
    pitch = (width + spacing) * 1e-3
    most = (across / 2 - 0.25) / pitch
    turns = max(1.0, round(pick.uniform(0.15, 1.0) * most * PARTS[shape]) / PARTS[shape])
    size: object = across
    if shape in ("rectangle", "racetrack"):
        size = [round(across * pick.uniform(1.1, 2.5), 2), across]
    long = size[0] if isinstance(size, list) else size
    coil = {
        "shape": shape, "outer_diameter": size, "turns": turns, "layers": layers, "trace_width": f"{width} um",
        "trace_spacing": f"{spacing} um", "start_angle": f"{pick.choice([0, 0, 30, 45, 90, 135, 200, 311])} deg",
        "sense": pick.choice(["counter-clockwise", "clockwise"]),
    }
    if shape not in ("circle", "racetrack") and pick.random() < 0.3:
        coil["corner_radius"] = round(pick.uniform(0.1, 0.3) * across, 2)
    gap = pick.choice([0.2, 0.5, 0.8, 1.2, 2.0])
    kind = pick.choice(["single", "line", "line", "line", "triangle", "grid", "grid", "explicit"])
    array: dict[str, object] = {"pattern": kind}
    if kind == "line":
        array |= {"count": pick.choice([2, 2, 3, 4, 5, 8]), "pitch": round(long + gap, 3)}
    elif kind == "triangle":
        array |= {"pitch": round(1.16 * long + gap, 3)}
    elif kind == "grid":
        array |= {"count": pick.choice([[2, 2], [2, 2], [3, 2], [2, 3], [3, 3]]), "pitch": round(long + gap, 3)}
    elif kind == "explicit":
        step = long + gap
        array["centres"] = [
            [round(k * step, 3), round(pick.uniform(-0.5, 0.5) * across, 3)] for k in range(pick.choice([2, 3, 4]))
        ]
    fpc: dict[str, object] = {"rules": rules}
    if pick.random() < 0.7:
        length, contacts = pick.choice([15, 30, 60]), pick.choice(["zif-0.5mm", "zif-0.5mm", "zif-0.3mm"])
        fpc["tail"] = {"length": length, "connector": contacts, "layers": pick.choice([1, 2, 2, 2])}
    return Board({"sitscad": 1, "name": f"random-{seed}", "coil": coil, "array": array, "fpc": fpc})


def has_room(spec: sitscad.SensorSpec) -> bool:
    """Whether a board meets the closed-form rules of room: inside the coils, between them, and on the tail."""
    rules, coil = spec.fpc.rules, spec.coil
    pad, gap = rules.via_drill + 2.0 * rules.annular_ring, rules.trace_spacing
    keep = max(pad / 2 + gap, rules.via_drill / 2 + rules.drill_to_copper)
    vias = (len(coil.layers) + 1) // 2 if len(coil.layers) > 1 or len(spec.fpc.stackup.copper) > 1 else 0
    if len(coil.layers) % 2 and len(spec.fpc.stackup.copper) == len(coil.layers):
        return False
    # Inside: one pad and two spacings for one via, two pads and three spacings for two, a ring of vias for more.
    between = max(pad + gap, rules.via_drill + rules.hole_to_hole, keep + pad / 2)
    needed = 2.0 * keep + (between / math.sin(math.pi / vias) if vias > 1 else 0.0)
    clear = min(coil.size) - 2.0 * coil.pitch * math.ceil(coil.turns)
    if clear < needed:
        return False
    # Between: a via and a pair of leads pass between two coils.
    centres = [p.centre for p in spec.array.placements]
    pairs = [(a, b) for i, a in enumerate(centres) for b in centres[:i]]
    room = 2.0 * keep + pad + coil.trace_width + gap
    for a, b in pairs:
        apart = max(abs(a[0] - b[0]) - coil.size[0], abs(a[1] - b[1]) - coil.size[1])
        if apart < room and math.dist(a, b) - max(coil.size) < room:
            return False
    # On the tail: pairs above each other where coils do not stand in one line; contacts at least two tracks apart.
    tail = spec.fpc.tail
    stacked = len(spec.fpc.stackup.copper) > 1 and (tail is None or tail.layers > 1)
    if not stacked and any(abs(y) > 1e-9 for _, y in centres):
        return False
    contact = tail.connector.pitch if tail else 1e-3
    return contact >= (keep + rules.trace_width / 2 if stacked else rules.trace_width + gap)


@dataclass(frozen=True)
class Outcome:
    """What became of a board."""

    seed: int
    shape: str
    array: str
    layers: int
    coils: int
    room: bool
    first: str
    steps: int
    last: str
    seconds: float
    faults: str


RULES = [rule for rule in sitscad.RULES if rule.id in ("SIT111", "SIT112", "SIT113", "SIT118", "SIT119")]
"""The rules of what the layout found no room for."""


def errors_of(spec: sitscad.SensorSpec) -> list:
    """What found no room, each with the change that gives some where trying finds one."""
    subject = Design(spec)
    message = [outcome for rule in RULES for outcome in rule_outcomes(rule, subject)[0]]
    result = Trials(subject, RULES, message, (), Budget.of("full")).advised() if message else []
    return [finding for finding in result if finding.severity == "error"]


def advised(now: Board, finding) -> Board | None:
    """The board changed as the finding says; None where it names nothing that was tried."""
    if finding.rule == "SIT111":
        return now.changed("coil", layers=int(finding.limit))
    if finding.rule == "SIT118":
        return now.changed("fpc", tail={**now.values["fpc"]["tail"], "layers": 2})
    if not finding.fixes:
        return None
    for edit in finding.fixes[0].edits:
        section, key = edit.key.split(".", 1)
        value = YAML(typ="safe").load(edit.new)
        if "." in key:
            key, inner = key.split(".")
            value = {**now.values[section][key], inner: value}
        now = now.changed(section, **{key: value})
    return now


def study(seed: int, deep: bool = True) -> tuple[Outcome, Board]:
    """Lay a board out, follow what its findings advise, and look for faults where it is routed."""
    now = board(seed)
    began = time.process_time()
    spec = now.load()
    layout = sitscad.lay_out(spec)
    seconds = time.process_time() - began
    room, result = has_room(spec), errors_of(spec) if layout.shortfalls else []
    first, steps = " ".join(f.rule for f in result), 0
    while result and steps < PATIENCE:
        after = advised(now, result[0])
        if after is None:
            break
        now, steps = after, steps + 1
        result = errors_of(now.load())
    last = " ".join(f.rule for f in result)
    faults = "" if result or not deep else "; ".join(faults_of(now))
    coils = len(spec.array.placements)
    return Outcome(seed, spec.coil.shape, spec.array.pattern, len(spec.coil.layers), coils, room, first, steps, last,
                   round(seconds, 3), faults), now


def faults_of(now: Board) -> list[str]:
    """What is wrong with a routed board: own rule check, nets read back, resistance of the copper as written."""
    with tempfile.TemporaryDirectory() as folder:
        built = sitscad.build(now.load(), folder, only=("gerber",), force=True)
        # the figures of the spec itself (SIT101 to SIT103, SIT116) are the study's own choice
        lines = [f for f in built.checked.findings if f.severity == "error" and f.rule not in CHOSEN]
        wrong = [f"{f.rule} {f.message}" for f in lines if "SIT101" <= f.rule < "SIT200"]
        wrong += [f"verify: {d}" for d in sitscad.verify(built.directory).differences]
    return wrong


def kicad_violations(now: Board) -> list[str]:
    """What kicad-cli says of a board."""
    with tempfile.TemporaryDirectory() as folder:
        built = sitscad.build(now.load(), folder, only=("kicad",), force=True)
        report, drawn = Path(folder) / "drc.json", next(built.directory.glob("kicad/*.kicad_pcb"))
        subprocess.run(["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "-o", report, drawn],
                       capture_output=True, check=True)
        lines = json.loads(report.read_text())
        return [v["description"] for v in lines["violations"] + lines["unconnected_items"]]


def resistance_gap(now: Board) -> float:
    """By which share the first coil's copper, read back from the files and solved, differs from the estimate."""
    from sitscad.files.extraction.differences import extract
    from tests.oracles.copper_resistance import copper_resistance

    with tempfile.TemporaryDirectory() as folder:
        directory = sitscad.build(now.load(), folder, only=("gerber",), force=True).directory
        nets = extract(directory)
    layout = sitscad.lay_out(now.load())
    stackup, coil = layout.spec.fpc.stackup, layout.coils[0]
    net = nets.net(coil.net)
    start, end = (touched(contact) for contact in sorted(net.contacts, key=lambda contact: contact.function))
    thickness, depths = zip(*((foil.thickness, foil.z) for foil in stackup.copper), strict=True)
    plating = stackup.plating_thickness or None
    result = copper_resistance(net, start, end, thickness, depths=depths, plating=plating, fineness=2.0)
    return result / sitscad.estimate(layout, tolerance=1e-2).coils[0].terminal_resistance_dc - 1.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boards", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kicad", type=int, default=0, help="how many routed boards go through kicad-cli")
    parser.add_argument("--resistance", type=int, default=0, help="of how many the resistance of the copper is solved")
    parser.add_argument("--shallow", action="store_true", help="lay out only")
    parser.add_argument("-o", "--output", type=Path)
    arguments = parser.parse_args()
    rows, sampled, gaps = [], 0, []
    for seed in range(arguments.first, arguments.first + arguments.boards):
        try:
            outcome, now = study(seed, not arguments.shallow)
        except sitscad.SpecError:  # coils that overlap: not a board
            continue
        except KeyboardInterrupt:  # the figures of those done so far
            break
        except Exception as error:
            outcome = Outcome(seed, "", "", 0, 0, False, "", 0, "", 0.0, f"exception {type(error).__name__}: {error}")
        if not outcome.last and not outcome.faults and sampled < arguments.kicad and seed % 3 == 0:
            sampled += 1
            outcome = replace(outcome, faults="; ".join(f"kicad: {v}" for v in kicad_violations(now)))
        if not outcome.last and not outcome.faults and len(gaps) < arguments.resistance and seed % 3 == 1:
            gaps.append(resistance_gap(now))
            if abs(gaps[-1]) > 0.01:
                outcome = replace(outcome, faults=f"resistance: {100 * gaps[-1]:+.1f} % from the estimate")
        rows.append(outcome)
        if outcome.faults or outcome.last or (outcome.room and outcome.first):
            print(outcome, flush=True)
    if arguments.output:
        with arguments.output.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, [f for f in Outcome.__dataclass_fields__])
            writer.writeheader()
            writer.writerows(vars(row) for row in rows)
    print("\n".join(summary(rows, sampled)))
    if gaps:
        print(f"resistance read back: {len(gaps)} boards, at most {100 * max(map(abs, gaps)):.2f} % from the estimate")


def summary(rows: list[Outcome], sampled: int) -> list[str]:
    """The study's figures, a line each."""
    room = [r for r in rows if r.room]
    routed = [r for r in room if not r.first]
    others = [r for r in rows if r.first]
    seconds = sorted(r.seconds for r in rows)
    return [
        f"{len(rows)} boards; {len(room)} meet the room rules, {len(routed)} of them are routed "
        f"({100 * len(routed) / max(1, len(room)):.1f} %); {sum(not r.first for r in rows)} routed in all",
        f"findings on the others: {dict(Counter(rule for r in others for rule in r.first.split()))}",
        f"{sum(not r.last for r in others)} of {len(others)} are routed once the finding's advice is followed "
        f"({dict(sorted(Counter(r.steps for r in others if not r.last).items()))} steps: boards); left: "
        f"{dict(Counter(r.last for r in others if r.last))}",
        f"faults of routed boards: {sum(bool(r.faults) for r in rows)}; {sampled} went through kicad-cli",
        f"seconds a layout: median {seconds[len(seconds) // 2]:.2f}, worst {seconds[-1]:.1f}",
    ]


if __name__ == "__main__":
    main()
