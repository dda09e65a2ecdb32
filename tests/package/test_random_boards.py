"""Random sensors over shapes, layers and arrays: built, accepted by KiCad's checker, extracted back to their nets."""

import json
import random
import subprocess

import pytest

import sitscad

needs_kicad = pytest.mark.clients("kicad-cli")


def random_spec(seed):
    pick = random.Random(seed)
    shape = pick.choice(["circle", "circle", "square", "hexagon", "octagon"])
    turns = pick.choice({"circle": [3.25, 4.5, 6.5, 7.75], "hexagon": [3, 5]}.get(shape, [3.25, 5, 6.5]))
    diameter, width = pick.choice([4, 5, 6]), pick.choice([80, 100])
    pitch = 1.16 * diameter + pick.choice([0.5, 0.8, 1.2])
    array = pick.choice(
        [
            "{pattern: single}",
            f"{{pattern: line, count: {pick.choice([2, 3, 4])}, pitch: {pitch:.3f}}}",
            f"{{pattern: triangle, pitch: {pitch:.3f}}}",
            f"{{pattern: grid, count: [2, 2], pitch: {pitch:.3f}}}",
        ]
    )
    tail = pick.choice(["", ", tail: {length: 25, connector: zif-0.5mm, layers: 2}"])
    return (
        f"sitscad: 1\nname: random-{seed}\n"
        f"coil: {{shape: {shape}, outer_diameter: {diameter}, turns: {turns}, "
        f"layers: {pick.choice([1, 2, 2, 3, 4, 4])}, "
        f"trace_width: {width} um, trace_spacing: {width} um, start_angle: {pick.choice([0, 0, 45, 90, 200])} deg, "
        f"sense: {pick.choice(['counter-clockwise', 'clockwise'])}}}\n"
        f"array: {array}\nfpc: {{rules: generic-fine{tail}}}\n"
    )


@pytest.mark.few(1)
@pytest.mark.slow
@needs_kicad
@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(n, marks=pytest.mark.more) for n in range(3, 16))])
def test_random_board_passes_kicad_and_verification(seed, tmp_path):
    pytest.importorskip("gerbonara", reason="verify reads Gerbers through gerbonara, which sitscad[all] brings")
    spec = sitscad.load_text(random_spec(seed), "random.yaml")
    layout = sitscad.lay_out(spec)
    if layout.shortfalls:
        assert all(lack.message for lack in layout.shortfalls)
        return
    findings = sitscad.check(spec, layout, hints="none").findings
    errors = [f for f in findings if f.severity == "error" and f.rule.startswith("SIT1")]
    assert errors == []
    sitscad.build(spec, tmp_path, only=("gerber", "kicad"), force=True)
    folder = tmp_path / f"random-{seed}"
    assert sitscad.verify(folder).ok
    report = tmp_path / "drc.json"
    board = next(folder.glob("kicad/*.kicad_pcb"))
    command = ["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "--exit-code-violations"]
    done = subprocess.run([*command, "-o", str(report), str(board)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, json.loads(report.read_text())
