"""The reference coil in the files of a package."""

import json

import pytest
from tolerance import approx

import sitscad
from sitscad.checks.performance import estimated_values
from sitscad.estimates.states.reference import reference_signal
from sitscad.files.documents import assembly_notes, firmware
from sitscad.files.documents.datasheet import sensor_summary_rows
from sitscad.layout.tail.tracks import contacts


@pytest.fixture(scope="module")
def design(root):
    spec = sitscad.load(root / "templates" / "grasper_4layer.yaml")
    return sitscad.Design(spec.replace("array.reference", {}))


@pytest.fixture(scope="module")
def files(design):
    return {path: content.decode() for path, content in firmware.render(design.spec, design.estimates).items()}


def test_firmware_reads_three_coils_and_maps_two(files):
    config = files["firmware/sensor_config.h"].splitlines()
    numbers = {words[1]: words[2] for words in (line.split() for line in config) if words[:1] == ["#define"]
               and len(words) > 2}
    assert (numbers["SENSOR_COILS"], numbers["SENSOR_CELL_COILS"], numbers["SENSOR_CELLS"]) == ("3", "2", "1")
    assert numbers["SENSOR_REFERENCE"] == "2"
    assert "REFERENCE = 2" in files["firmware/micropython/sensor_config.py"]


def test_channel_list_marks_reference_coil(files, design):
    table = json.loads(files["firmware/ldc1614_config.json"])
    assert [coil.get("is_reference", False) for coil in table["coils"]] == [False, False, True]
    assert table["converters"][0]["channels"] == ["C1", "C2", "C3"]
    assert table["coils"][2]["channel"] == 2 and list(table["coils"][2]["expected"]) == ["free", "rest"]
    assert {each.coil for each in contacts(design.layout)} == {"C1", "C2", "C3 (ref.)"}


def test_assembly_notes_mention_reference_coil_once(design):
    text = assembly_notes.instructions(design.layout, design.estimates, design.estimates)
    assert sum("reference coil" in " ".join(step.split()) for step in text.split("\n\n")) == 1


def test_data_sheet_states_target_signal_in_reference_coil(design):
    summary = sensor_summary_rows(design.performance, design.layout, design.estimates)
    rows = dict(row for row in summary if len(row) == 2)
    share = reference_signal(design.layout, design.estimates).share
    assert rows["reference coil"].startswith("C3")
    assert float(rows["signal of the target on C3"].split(" %")[0]) == approx(100.0 * share, rel=0.05)


def test_estimated_values_beside_reference_coil_name_no_cell(root):
    bench = sitscad.load(root / "templates" / "bench_7mm.yaml")
    bench = bench.replace({"array.reference": {}, "requirements.normal_resolution": 0.05})
    results = estimated_values(sitscad.Design(bench).cells)
    assert results and not [result.at for result in results if "cell" in result.at]
