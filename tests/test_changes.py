"""What docs/house.md says that a change costs: each change is made in a copy of the package, and the copy is run."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tolerance import approx

from sitscad.assembly.places.state import TANK, StateKind, require_within_requirements

PACKAGE = Path(__file__).resolve().parents[1] / "sitscad"

SPEC = """sitscad: 1
name: changes
coil: {shape: circle, outer_diameter: 6, turns: 10, layers: 2, trace_width: 120 um, trace_spacing: 100 um}
fpc: {rules: our-house}
array: {count: 2, pitch: 6.5}
target: {material: copper, size: [12.5, 6], thickness: 0.3}
elastomer: {material: our-silicone, size: [12.5, 6], thickness: 1}
requirements: {normal_force: 2 N, shear_force: 0.5 N, normal_resolution: 50 mN}
"""

PENTAGON = """sitscad: 1
name: pentagon
coil: {shape: SHAPE, outer_diameter: 10, turns: 6, layers: 2, trace_width: 200 um, trace_spacing: 200 um}
"""

JAW = """
fpc: {tail: {length: 20, connector: our-plug}}
mount: {kind: grasper-pad, jaw: our-jaw}
"""
"""Added to the text of a pentagon."""

COPIES = {
    "data/connectors/our-plug.csv": "data/connectors/zif-0.5mm.csv",
    "data/jaws/our-jaw.csv": "data/jaws/robotic-12mm.csv",
}
"""Files of the copy that stand there under another name, too."""

NEW_FILES = {
    "data/fabricators/our-house.yaml": 'based_on: generic-flex\nvia_drill: {value: 0.25 mm, source: "our drills"}\n',
    "files/formats/centres.py": '''"""The centres of the coils as a table."""


def render(layout):
    """Return the table."""
    rows = [f"{coil.name},{coil.centre.x:.6e},{coil.centre.y:.6e}" for coil in layout.coils]
    return {"fpc/centres.csv": "\\n".join(["coil,x_m,y_m", *rows, ""]).encode()}
''',
}
NEW_FILES["files/documents/centres.py"] = NEW_FILES["files/formats/centres.py"].replace(".csv", ".txt")
"""Files that a change adds to the copy."""

RULE = '''LARGEST_COIL = 5e-3  # of our winder (m)


def wound_by_us(design: Design) -> Iterator[Verdict]:
    """The coil against our winder."""
    size = max(design.spec.coil.size)
    if size > LARGEST_COIL:
        yield violation_of("winder", "coil", size, LARGEST_COIL, "m")


'''

PRESSED = "    StateKind(PRESSED,"

INSERTIONS = {
    "checks/reading/timing.py": (
        ("RULES: tuple[Rule, ...]", RULE),
        ('    rule_of("SIT207"', '    rule_of("SIT290", wound_by_us),\n'),
    ),
    "data/messages.csv": (("SIT301,flat-body,", "SIT290,winder,the coil is {measured:m} large,use a smaller coil,\n"),),
    "data/rules.csv": (("SIT301,", "SIT290,our-winder,warning,,Our winder takes it.,It has to.,Smaller.,us\n"),),
    "data/elastomers.csv": (
        ("ecoflex-00-30,", "our-silicone,00-40,platinum,1070,30 kPa,12 kPa,,1.5 GPa,2.42,0.1,0.1,0.05,3411 ppm/K,"
                           "300 ppm/K,verified,our test,unverified,our test\n"),
    ),
    "files/formats/__init__.py": (
        ('    Writer("kicad",', '    Writer("centres", "files.formats.centres", "gerber"),\n'),
    ),
    "files/documents/__init__.py": (
        ('    Writer("stack-up drawing",', '    Writer("centres", "files.documents.centres", "gerber"),\n'),
    ),
    "kernels/geometry/shapes.py": (
        ('        Polygon("hexagon",', '        Polygon("pentagon", "pentagonal", 5, bounds=("square", "hexagon")),\n'),
        ('        Polygon("hexagon",', '        Polygon("heptagon", "heptagonal", 7),\n'),
    ),
    "assembly/places/state.py": (
        (PRESSED, '    StateKind("touch", "touched", "touch", (0.01, 0.0, 0.0), (TANK, SIGNAL)),\n'),
        (PRESSED, '    StateKind("grip", "in a grip", "grip (half the force)", (0.5, 0.0, 0.0), (TANK, SIGNAL)),\n'),
        (PRESSED, '    StateKind("drag", "dragged", "drag (with shear)", (0.5, 1.0, 0.0), (TANK, SIGNAL)),\n'),
    ),
}
"""By file of the copy: the place before which a change puts a text, and the text."""

PROGRAM = '''
import json, sys
import sitscad
from sitscad.checks.judging import apply_rules
from sitscad.checks.reading.readings import all_readings
from sitscad.checks.reading.response import responses
from sitscad.estimates.circuits.settings import frequency_bands
from sitscad.estimates.design import Design
from sitscad.estimates.performance.tables import PerformanceReport
from sitscad.files.documents import firmware
from sitscad.files.documents.datasheet import figures_for_programs
from sitscad.files.report.numbers import state_table
from sitscad.spec.load import load_text

design = Design(load_text(sys.argv[1], "changes.yaml"))
report = PerformanceReport(design.performance, design.spec)
result = apply_rules(design, "none")
files = firmware.render(design.spec, design.estimates)
pentagon = load_text(sys.argv[2].replace("SHAPE", "pentagon"), "pentagon.yaml")
jaw = load_text(sys.argv[2].replace("SHAPE", "pentagon") + sys.argv[3], "jaw.yaml")
try:
    heptagon = repr(sitscad.estimate(sitscad.lay_out(load_text(sys.argv[2].replace("SHAPE", "heptagon"), "h.yaml"))))
except Exception as error:
    heptagon = f"{type(error).__name__}: {error}"
print(json.dumps({
    "package": sitscad.__file__,
    "estimate": design.estimates.as_json("changes.yaml"),
    "findings": [finding.rule for finding in result.findings],
    "judged": {
        "tank": sorted({reading.state
                        for reading in all_readings(design.estimates.coils, "parallel_resistance", True)}),
        "signal": {
            state: [one.steps
                    for one in responses(design.estimates.coils, design.estimates.readout.conversion, state)]
            for state in ("grip", "pressed")
        },
    },
    "response_Hz": sitscad.respond(design, loads=[[1.0, 0.0, 0.0]]).frequency[0].tolist(),
    "not_checked": [f"{one.rule} {one.reason}" for one in result.not_checked],
    "table": [row[1] for row in state_table(design.estimates.coils, 20.0).rows],
    "sheet": json.loads(figures_for_programs(report, None)),
    "notes": list(design.performance[-1].notes),
    "firmware": {name: data.decode() for name, data in files.items() if name.endswith((".h", ".json"))},
    "rules": [design.spec.fpc.rules.name, design.spec.fpc.rules.via_drill],
    "names": [design.spec.elastomer.material.name, jaw.fpc.tail.connector.name, jaw.jaw.preset],
    "working_ends_Hz": [[band.working.low, band.working.high] for band in frequency_bands(design.estimates.coils, 0.0)],
    "pentagon": [coil.winding_inductance for coil in sitscad.estimate(sitscad.lay_out(pentagon)).coils],
    "written": sitscad.build(pentagon, "out", only=("gerber",)).written,
    "heptagon": heptagon,
}, default=str))
'''


@pytest.fixture(scope="module")
def changed(tmp_path_factory):
    """Results of a copy of the package with all changes."""
    folder = tmp_path_factory.mktemp("changed")
    copy = folder / "sitscad"
    shutil.copytree(PACKAGE, copy)  # with its compiled modules, which hold for the copies of their sources
    for path, text in NEW_FILES.items():
        (copy / path).write_text(text, encoding="utf-8")
    for path, other in COPIES.items():
        shutil.copy(copy / other, copy / path)
    for path, insertions in INSERTIONS.items():
        source = (copy / path).read_text(encoding="utf-8")
        for place, text in insertions:
            assert source.count(place) == 1, (path, place)
            source = source.replace(place, text + place)
        (copy / path).write_text(source, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, SPEC, PENTAGON, JAW], cwd=folder, capture_output=True, text=True, check=False,
        env={"PATH": "", "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert Path(result["package"]).is_relative_to(folder)
    written = folder / "out" / "pentagon" / "fpc"
    return result | {name: (written / name).read_text(encoding="utf-8").splitlines()
                    for name in ("centres.csv", "centres.txt")}


def test_fabricator_connector_jaw_and_material_are_added_by_data_only(changed):
    assert changed["rules"] == ["our-house", approx(0.25e-3, rel=1e-9)]
    assert changed["names"] == ["our-silicone", "our-plug", "our-jaw"]


def test_rule_is_added_by_function_and_text_row(changed):
    assert "SIT290" in changed["findings"]


@pytest.mark.parametrize("name", ["centres.csv", "centres.txt"])
def test_format_or_document_is_added_by_module_and_row(changed, name):
    assert changed[name][0] == "coil,x_m,y_m" and changed[name][1].startswith("C1,")


def test_shape_is_added_by_row_and_refused_without_error_bounds(changed):
    assert 1e-6 < changed["pentagon"][0] < 3e-6
    assert changed["heptagon"].startswith("SpecError") and "heptagon" in changed["heptagon"]


def test_state_added_by_row_appears_in_estimates_checks_and_files(changed):
    coils, sheet = changed["estimate"]["coils"], {point["at"]: point for point in changed["sheet"]["performance"]}
    assert all(list(coil["states"]) == ["free", "rest", "touch", "grip", "pressed"] for coil in coils)
    states, gaps = coils[0]["states"], changed["estimate"]["gaps_m"]
    assert gaps["rest"] > gaps["grip"] > gaps["pressed"] and changed["estimate"]["gaps_sigma_m"]["grip"] > 0.0
    assert states["rest"]["inductance_H"] > states["grip"]["inductance_H"] > states["pressed"]["inductance_H"]
    assert states["grip"]["sigma"]["frequency_Hz"] == approx(states["pressed"]["sigma"]["frequency_Hz"], rel=0.05)
    # the response solves the same load by itself
    assert [coil["states"]["grip"]["frequency_Hz"] for coil in coils] == approx(changed["response_Hz"], rel=1e-5)
    assert changed["judged"]["tank"] == ["grip", "pressed", "rest", "touch"]
    assert "grip (half the force)" in changed["table"]
    signal = changed["judged"]["signal"]
    assert all(0.4 < a / b < 0.6 for a, b in zip(signal["grip"], signal["pressed"], strict=True))
    assert "SIT215" in changed["findings"]  # nobody feels the touch
    low, high = changed["working_ends_Hz"][0]
    assert low < states["rest"]["frequency_Hz"] < states["grip"]["frequency_Hz"] < high
    assert list(sheet) == ["rest", "touch", "half", "grip", "full"]
    assert sheet["grip"]["load_N"]["normal"] == approx(1.0, rel=1e-6)
    errors = {at: point["axes"]["normal"]["errors_N"]["manufacture, after calibration"] for at, point in sheet.items()}
    assert errors["half"] == errors["grip"] < errors["full"]
    expected = json.loads(changed["firmware"]["firmware/ldc1614_config.json"])["coils"][0]["expected"]["grip"]
    header = changed["firmware"]["firmware/ldc1614_config.h"]
    assert (expected["force_N"], expected["frequency_Hz"]) == (1.0, states["grip"]["frequency_Hz"])
    assert "FORCE_GRIP_N 1.000000000e+00" in header
    assert f"COIL0_L_GRIP_H {states['grip']['converter_inductance_H']:.9e}" in header


def test_state_with_shear_is_reported_as_failed_by_name(changed):
    assert all(coil["failed_states"].keys() == {"drag"} for coil in changed["estimate"]["coils"])
    unknown = {line.split()[0] for line in changed["not_checked"] if "dragged" in line}
    assert unknown >= {"SIT201", "SIT202", "SIT203", "SIT204", "SIT205", "SIT206", "SIT215", "SIT217"}
    assert any(note.startswith("drag: ") for note in changed["notes"])
    assert any(note.startswith("drag: ") for note in changed["estimate"]["notes"])
    assert " * drag: " in changed["firmware"]["firmware/ldc1614_config.h"]


@pytest.mark.parametrize("load", [(1.5, 0.0, 0.0), (-0.1, 0.0, 0.0), (1.0, 1.0, 0.5)])
def test_state_beyond_required_forces_is_refused_by_name(load):
    with pytest.raises(ValueError, match="state crush"):
        require_within_requirements((StateKind("crush", "crushed", "crushed", load, (TANK,)),))
