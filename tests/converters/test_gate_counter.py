"""A converter of another kind, added by one module and one file of figures: it counts sensor periods in a fixed gate.

Each figure is compared with a formula by hand. A part that sitscad has for TI's converters alone is refused by name.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.apps.hardware.converter import SimulatedConverter
from sitscad.apps.hardware.source import open_source
from sitscad.calibration.calibration import simulated_sensors
from sitscad.cli import run
from sitscad.data import PACKAGE, DataError, rows
from sitscad.estimates.requested_response import respond
from sitscad.kernels.converters.figures import family_rows, source_in_all
from sitscad.spec import presets
from tests.converters.conftest import FAMILY, forget
from tests.converters.family import gate_counter
from tests.hardware.conftest import TEMPLATES

ROW = 'xgc4,gate_counter,4,0x20 0x21,"QFN-24, 5 x 5 mm",verified,"X Corp XGC4 data sheet XGC0001, 3"\n'
START, SWITCH = 30e-6, 10e-6
"""Times (s) of its data sheet: `start_time` and `switch_time`."""

OF_TI = re.compile(
    r"RCOUNT|SETTLECOUNT|FIN_DIVIDER|FREF|f_REF|INx|CLKIN|SNOS|LDC1\d1\d|\bTI\b|DRIVE_CURRENT|OUTPUT_GAIN"
)
"""Words that are of TI's converters."""


SETTINGS_OF_TI = re.compile(r"rcount|settle_?count|(input|reference|fin|fref)_divider|noise_steps", re.IGNORECASE)
"""Settings and figures of TI's counter."""

OWN = ("kernels/converters/", "apps/hardware/converter.py", "files/documents/firmware_driver.py")
"""Its conversion, the simulated chip and the tables of its driver."""


def test_reference_counter_settings_occur_only_in_its_modules():
    modules = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*.py")}
    others = [path for name, path in modules.items() if not name.startswith(OWN)]
    assert len(others) > 300
    assert [path.name for path in others if SETTINGS_OF_TI.search(path.read_text(encoding="utf-8"))] == []


@pytest.fixture
def xgc4(monkeypatch, data):
    """The converter, added by its file, its module and its row in the list of parts."""
    shutil.copy(FAMILY / "gate_counter.csv", data / "converters")
    with (data / "converters.csv").open("a") as table:
        table.write(ROW)
    monkeypatch.setitem(sys.modules, "sitscad.kernels.converters.gate_counter", gate_counter)
    forget()
    return presets.converter("xgc4")


@cache
def design_of(device, scan_rate=200.0):
    """The bench's template with another converter. Tests share the designs."""
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    return sitscad.Design(replace(spec, readout=replace(spec.readout, device=device, scan_rate=scan_rate)))


def test_gate_counter_times_follow_the_scan_rate(xgc4):
    design = design_of(xgc4)
    readout, coils = design.estimates.readout, len(design.estimates.coils)
    gate = 1.0 / (200.0 * coils) - START - SWITCH
    times = readout.settle_time, readout.conversion_time, readout.switch_time
    assert times == approx((START, gate, SWITCH), rel=1e-12)
    assert readout.scan_rate == approx(200.0, rel=1e-12)
    assert readout.read_back_time == approx(coils * 58 / 1e6, rel=1e-12)
    assert readout.supply_current == approx(3e-3 + coils * readout.drive_current, rel=1e-12)
    settings = design.estimates.as_json("bench.yaml")["readout"]
    assert settings["gate_s"] == approx(gate, rel=1e-12)
    assert not {"rcount", "settle_count", "input_divider", "reference_divider", "output_gain"} & settings.keys()


def test_gate_counter_resolution_is_one_count_and_noise_from_both_ends(xgc4):
    design = design_of(xgc4)
    gate = design.estimates.readout.conversion_time
    for coil in design.estimates.coils:
        for state in coil.states.values():
            assert state.quantum == approx(2.0 * state.inductance / (gate * state.frequency), rel=1e-9)
            assert state.noise == approx(state.quantum / math.sqrt(12.0), rel=1e-9)
    sensors = simulated_sensors(design.response)
    rest = [coil.states["rest"].frequency for coil in design.estimates.coils]
    assert sensors.noise == approx([1.0 / (math.sqrt(6.0) * gate * each) for each in rest], rel=1e-9)
    counts = design.estimates.readout.conversion.read(np.array([rest]))
    assert counts[0] == approx(np.floor(np.array(rest) * gate + 0.5), rel=1e-12)


def test_gate_counter_amplitude_follows_sine_drive(xgc4):
    design = design_of(xgc4)
    readout = design.estimates.readout
    for coil in design.estimates.coils:
        for state in coil.states.values():
            assert state.amplitude == approx(readout.drive_current * state.parallel_resistance, rel=1e-9)
    assert readout.drive_current in xgc4.drive_currents and not readout.high_current
    assert readout.conversion_capacitance == approx(readout.capacitance + 7e-12, rel=1e-12)


def test_gate_counter_force_resolution_follows_its_noise(xgc4):
    """Of two coils alike: normal force by their sum, shear by their difference."""
    design = design_of(xgc4)
    gate = design.estimates.readout.conversion_time
    for axis in design.performance[1].axes.values():
        by_hand = 1.0 / (math.sqrt(6.0) * gate) / math.sqrt(2.0) / np.mean(np.abs(axis.sensitivity))
        assert axis.resolution == approx(by_hand, rel=0.02)
    read = respond(design, loads=np.array([[1.0, 0.0, 0.0]]))
    assert np.abs(read.counts - read.frequency * gate).max() <= 0.5


def test_gate_counter_with_short_result_uses_shorter_gate(xgc4, data):
    place = data / "converters/gate_counter.csv"
    place.write_text(place.read_text().replace("result_bits,24", "result_bits,12"))
    forget()
    design = design_of(presets.converter("xgc4"), 10.0)
    conversion = design.estimates.readout.conversion
    highest = max(state.frequency for coil in design.estimates.coils for state in coil.states.values())
    assert conversion.gate * highest < 2**12 - 1 < conversion.gate * highest * 1.2
    assert highest < conversion.highest_frequency == (2**12 - 1) / conversion.gate


def test_gate_counter_result_overflow_yields_capacitance_finding(xgc4):
    design = design_of(xgc4)
    readout = design.estimates.readout
    short = replace(readout, conversion=replace(readout.conversion, gate=10.0))
    design = sitscad.Design(design.spec, given_estimates=replace(design.estimates, readout=short))
    findings = sitscad.check(design.spec, estimates=design.estimates, hints="none").findings
    (finding,) = [item for item in findings if item.rule == "SIT207"]
    assert finding.key == "readout.capacitance" and finding.limit == approx((2**24 - 1) / 10.0, rel=1e-12)
    assert finding.source == "X Corp XGC4 data sheet XGC0001 (2026), row 1"


def test_gate_counter_limits_cite_no_ti_source(xgc4):
    figures = {name for family in ("ldc161x", "gate_counter") for name in family_rows(family)}
    cited = 0
    for rule in rows("rules"):
        names = figures & set(re.findall(r"{(\w+)}", rule["source"]))
        text = xgc4.text_with_own_sources("; ".join(map(source_in_all, sorted(names))))
        assert not names or (text and not re.search("SNOSC|SNOA949", text)), rule["id"]
        cited += bool(names)
    assert cited > 8


@pytest.mark.slow
def test_gate_counter_package_builds_without_register_files_or_ti_names(xgc4, tmp_path, monkeypatch):
    spec = tmp_path / "gate.yaml"
    text = (TEMPLATES / "bench_7mm.yaml").read_text(encoding="utf-8")
    spec.write_text("\n".join(line.partition(" #")[0] for line in text.splitlines() if not line.startswith("#"))
                    .replace("ldc1614", "xgc4"), encoding="utf-8")
    assert run(["build", str(spec), "-o", str(tmp_path), "--jobs", "1", "--only",
                "gerber,kicad,firmware,datasheet,calibration,report"]) == 0
    (package,) = (path.parent for path in tmp_path.glob("*/manifest.json"))
    config = json.loads((package / "firmware/xgc4_config.json").read_text())
    assert "XGC4" in config["refused"] and config["converters"] == []
    assert (package / "firmware/xgc4_config.h").read_text().startswith("#error")
    readme = (package / "firmware/readme.txt").read_text()
    assert "no driver for XGC4" in readme and "no registers of XGC4" in " ".join(readme.split())
    assert not (package / "firmware/wiring").exists()
    estimate = json.loads((package / "estimate.json").read_text())["readout"]
    assert estimate["conversion_time_s"] == estimate["gate_s"]
    for path in package.rglob("*"):
        if path.suffix in (".json", ".txt", ".html", ".csv", ".h", ".c", ".svg") and path.name != "readme.txt":
            result = OF_TI.search(path.read_text(encoding="utf-8"))
            assert result is None, (path.name, result)


def test_gate_counter_bench_programs_are_refused_by_name(xgc4):
    design = design_of(xgc4)
    for text in ("/dev/i2c-1", "serial:/dev/ttyACM0"):
        with pytest.raises(ValueError, match="no driver for XGC4"):
            open_source(text, design)
    with pytest.raises(ValueError, match="no XGC4 is simulated"):
        SimulatedConverter(design)
    with pytest.raises(ValueError, match="no registers of XGC4"):
        xgc4.register_map  # noqa: B018 - the property refuses


@pytest.mark.parametrize("name", ["gate_max", "noise_law", "coil_pins", "conversion"])
def test_gate_counter_data_without_required_row_are_refused(xgc4, data, name):
    place = data / "converters/gate_counter.csv"
    place.write_text("".join(row for row in place.read_text().splitlines(True) if not row.startswith(f"{name},")))
    forget()
    with pytest.raises(DataError, match=f"gate_counter.csv, {name}: no such row"):
        presets.converter("xgc4")


def test_gate_counter_module_without_required_function_is_refused(xgc4, monkeypatch):
    monkeypatch.delattr(gate_counter, "read_back_time")
    forget()
    with pytest.raises(DataError, match="gate_counter lacks read_back_time"):
        presets.converter("xgc4")
