"""Coils whose layers have different numbers of turns: drawn, estimated, exported, accepted by KiCad and read back."""

from __future__ import annotations

import json
import math
import subprocess
from dataclasses import replace
from itertools import pairwise

import pytest
from probe_spots import touched
from tolerance import approx

import sitscad
from sitscad.estimates import estimate
from sitscad.layout.windings import wind_coil
from sitscad.spec.reading import SpecError

COILS = {
    "one turn fewer below": ("circle", 4, [7.75, 6.75, 7.75, 6.75], 4),
    "more inside": ("circle", 4, [4.5, 7.25], 2),
    "every layer another": ("circle", 5, [8, 6.3, 4.1, 2.7], 4),
    "three layers": ("circle", 5, [6, 7.5, 5], 3),
    "chosen layers": ("circle", 5, [7, 5], "[1, 3]"),
    "square": ("square", 5, [7, 6.25, 7, 5.5], 4),
    "rectangle": ("rectangle", "[6, 4.5]", [5.25, 4], 2),
    "hexagon": ("hexagon", 5, [5.5, 4.5, 5], 3),
    "octagon": ("octagon", 5, [6.125, 6, 5.875, 6], 4),
    "racetrack": ("racetrack", "[7, 4.5]", [6, 5.5, 5, 4.5], 4),
}


def text_of(shape, size, turns, layers, array="{pattern: single}"):
    return (
        f"sitscad: 1\nname: unequal\n"
        f"coil: {{shape: {shape}, outer_diameter: {size}, turns: {turns}, layers: {layers}, trace_width: 80 um, "
        f"trace_spacing: 80 um}}\narray: {array}\n"
        "fpc: {stackup: flex-4l, rules: generic-fine, tail: {length: 25, connector: zif-0.5mm, layers: 2}}\n"
    )


def spec_of(name):
    return sitscad.load_text(text_of(*COILS[name]), "unequal.yaml")


@pytest.mark.parametrize("name", COILS)
def test_unequal_layers_connect_and_circulate_in_one_direction(name):
    spec = spec_of(name)
    layout = sitscad.lay_out(spec)
    assert layout.shortfalls == ()
    windings = layout.coils[0].windings
    assert spec.coil.layer_turns == tuple(COILS[name][2]) and spec.coil.most_turns == max(COILS[name][2])
    for winding, turns in zip(windings, spec.coil.layer_turns, strict=True):
        ways = [p for segment in winding.path for p in segment.flattened(2e-6)]
        steps = [math.remainder(math.atan2(b.y, b.x) - math.atan2(a.y, a.x), 2 * math.pi)
                 for a, b in pairwise(ways)]
        assert math.fsum(steps) / (2 * math.pi) == approx(turns, abs=0.06)
    for item, other in pairwise(windings):
        ends = [math.atan2(p.y, p.x) for p in (item.path.end, other.path.start)]
        # polygons and racetracks: corners of turns further in do not lie in quite the same direction
        assert abs(math.remainder(ends[0] - ends[1], 2 * math.pi)) < (1e-6 if spec.coil.shape == "circle" else 0.25)


@pytest.mark.parametrize("name", ["every layer another", "hexagon"])
def test_resistance_follows_drawn_copper(name):
    layout = sitscad.lay_out(spec_of(name))
    coil, spec = layout.coils[0], layout.spec
    result = estimate(layout).coils[0]
    squares = math.fsum(w.path.length / w.thickness for w in coil.windings) / spec.coil.trace_width
    assert result.resistance_dc == approx(squares / 58e6, rel=0.02)


def test_nearly_equal_layer_turns_give_values_of_equal_turns():
    equal = sitscad.load_text(text_of("circle", 4, 7.75, 4), "x.yaml")
    nearly = sitscad.load_text(text_of("circle", 4, [7.75, 7.749999, 7.75, 7.749999], 4), "x.yaml")
    item, other = (estimate(sitscad.lay_out(spec)).coils[0] for spec in (equal, nearly))
    for field in ("winding_inductance", "resistance_dc", "resistance_ac", "winding_capacitance", "terminal_inductance"):
        assert getattr(other, field) == approx(getattr(item, field), rel=1e-4), field


def test_one_turn_fewer_on_some_layers_gives_intermediate_values():
    values = []
    for turns in (7.75, [7.75, 6.75, 7.75, 6.75], 6.75):
        found = estimate(sitscad.lay_out(sitscad.load_text(text_of("circle", 4, turns, 4), "x.yaml"))).coils[0]
        values.append((found.winding_inductance, found.resistance_ac, found.winding_capacitance, found.trace_length))
    assert all(high > middle > low for high, middle, low in zip(*values, strict=True))


@pytest.mark.parametrize(
    ("turns", "layers", "rule", "key"),
    [
        ([7, 6, 5], 2, "SIT009", "coil.turns"),
        ([7], 2, None, None),
        ([7, 7], 2, None, None),
        ([7, 60], 2, "SIT016", "coil.turns.1"),
        ([7, ".nan"], 2, "SIT006", "coil.turns"),
        ([7, "x"], 2, "SIT004", "coil.turns"),
        ([], 2, "SIT006", "coil.turns"),
    ],
)
def test_turns_list_that_exceeds_layers_or_room_is_refused(turns, layers, rule, key):
    text = text_of("circle", 5, str(turns).replace("'", ""), layers)
    if rule is None:
        assert sitscad.load_text(text).coil == sitscad.load_text(text_of("circle", 5, 7, layers)).coil
        return
    with pytest.raises(SpecError) as caught:
        sitscad.load_text(text)
    if rule == "SIT009":
        assert (caught.value.findings[0].measured, caught.value.findings[0].limit) == (3.0, 2.0)
    assert [(f.rule, f.key) for f in caught.value.findings] == [(rule, key)]


def test_invalid_turns_of_one_layer_give_finding_at_its_position():
    with pytest.raises(SpecError) as caught:
        sitscad.load_text(text_of("square", 5, [7, 6.3], 2))
    (findings,) = caught.value.findings
    assert (findings.rule, findings.key, findings.limit) == ("SIT015", "coil.turns.1", 6.25)
    assert findings.column == text_of("square", 5, [7, 6.3], 2).splitlines()[2].index("6.3") + 1


def test_all_coils_of_array_have_equal_windings():
    array = "{pattern: line, count: 2, pitch: 5.2}"
    spec = sitscad.load_text(text_of("circle", 4, [7.75, 6.75, 7.75, 6.75], 4, array), "x.yaml")
    layout = sitscad.lay_out(spec)
    assert layout.shortfalls == () and len(layout.coils) == 2
    for coil in layout.coils:
        home = wind_coil(spec.artwork, replace(coil.placement, centre=(0.0, 0.0)))
        assert [w.path.length for w in coil.windings] == approx([w.path.length for w in home], rel=1e-6)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.clients("kicad-cli")
@pytest.mark.parametrize("name", [
    pytest.param(n, marks=() if n in ("one turn fewer below", "hexagon") else [pytest.mark.slow, pytest.mark.more])
    for n in COILS
])
def test_unequal_turns_board_passes_kicad_and_verification(name, tmp_path):
    pytest.importorskip("gerbonara", reason="verify reads Gerbers through gerbonara, which sitscad[all] brings")
    spec = spec_of(name)
    findings = sitscad.check(spec, hints="none").findings
    errors = [f for f in findings if f.severity == "error" and f.rule.startswith("SIT1")]
    assert errors == []
    sitscad.build(spec, tmp_path, only=("gerber", "kicad"), force=True)
    assert sitscad.verify(tmp_path / "unequal").ok
    report = tmp_path / "drc.json"
    board = next((tmp_path / "unequal").glob("kicad/*.kicad_pcb"))
    command = ["kicad-cli", "pcb", "drc", "--format", "json", "--severity-all", "--exit-code-violations"]
    done = subprocess.run([*command, "-o", str(report), str(board)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, json.loads(report.read_text())


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.needs("gmsh", "scipy")
@pytest.mark.parametrize("name", ["every layer another", "hexagon"])
def test_resistance_of_extracted_copper_equals_estimate(name, tmp_path):
    for module in ("gerbonara", "shapely", "gmsh", "scipy"):
        pytest.importorskip(module)
    from sitscad.files.extraction.differences import extract
    from sitscad.files.formats import gerber, ipc356
    from tests.oracles.copper_resistance import copper_resistance

    layout = sitscad.lay_out(spec_of(name))
    for render in (gerber.render, gerber.render_drills, ipc356.render):
        for file, content in render(layout).items():
            (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / file).write_bytes(content)
    net = extract(tmp_path).net("C1")
    ends = [touched(contact) for contact in sorted(net.contacts, key=lambda contact: contact.function)]
    copper, plating = layout.spec.fpc.stackup.copper, layout.spec.fpc.stackup.plating_thickness
    result = copper_resistance(
        net, *ends, [c.thickness for c in copper], depths=[c.z for c in copper], plating=plating or None, fineness=1.0
    )
    assert result == approx(estimate(layout).coils[0].terminal_resistance_dc, rel=0.02)
