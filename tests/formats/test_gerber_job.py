"""The job file: consistent with the files of the set and with the stack-up."""

from __future__ import annotations

import json

import layouts
from gerber_shapes import read
from tolerance import approx

from sitscad.files.formats import gerber


def job_of(board) -> dict:
    (text,) = gerber.render_job(board).values()
    return json.loads(text)


def test_job_file_lists_each_gerber_file_with_its_attributes(board):
    listed = {entry["Path"]: entry for entry in job_of(board)["FilesAttributes"]}
    files = {path.rpartition("/")[2]: text for path, text in gerber.render(board).items()}
    drills = {path.rpartition("/")[2] for path in gerber.render_drills(board)}
    assert set(listed) == set(files) | drills
    for name, text in files.items():
        attributes = read(text).file_attrs
        assert listed[name]["FileFunction"] == ",".join(attributes[".FileFunction"])
        assert listed[name]["FilePolarity"] == attributes[".FilePolarity"][0]


def test_job_file_stackup_lists_every_layer_with_thickness(board):
    rows, layers = job_of(board)["MaterialStackup"], board.spec.fpc.stackup.layers
    kinds = {"coverlay": "SolderMask", "copper": "Copper", "dielectric": "Dielectric"}
    assert [(row["Type"], row["Thickness"]) for row in rows] == [
        (kinds[layer.kind], approx(layer.thickness * 1e3, rel=1e-6)) for layer in layers
    ]
    assert rows[0]["Name"] == "Top coverlay" and rows[-1]["Name"] == "Bottom coverlay"
    dielectric = next(row for row in rows if row["Type"] == "Dielectric")
    assert dielectric["DielectricConstant"] == 3.4 and dielectric["Material"] == "polyimide"


def test_job_file_states_layer_count_size_and_thickness(board):
    specs = job_of(board)["GeneralSpecs"]
    assert specs["LayerNumber"] == board.copper_layers
    assert specs["Size"] == {"X": approx(20.4, rel=1e-6), "Y": approx(4.7, rel=1e-6)}
    assert specs["BoardThickness"] == approx(
        sum(row["Thickness"] for row in job_of(board)["MaterialStackup"]), rel=1e-6
    )


def test_project_identifier_depends_only_on_name():
    def guid(board):
        return job_of(board)["GeneralSpecs"]["ProjectId"]["GUID"]

    assert guid(layouts.two_coils()) == guid(layouts.two_coils(4)) != guid(layouts.two_coils(name="other"))
    assert guid(layouts.two_coils()).encode() in gerber.render(layouts.two_coils())["fpc/two-coils-F_Cu.gbr"]
