"""Revision, part number and date of a spec: on every paper, in every file that has a place for them, and refused where
a format could not hold them.
"""

from __future__ import annotations

import csv
import io
import json
import re
import warnings
from dataclasses import replace

import pytest

from sitscad.estimates.design import Design
from sitscad.files.documents import assembly_notes, laser_notes
from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.documents import parts_list as bom
from sitscad.files.documents.drawings import board_drawing, panel_drawing
from sitscad.files.documents.drawings import stackup as stackup_drawing
from sitscad.files.documents.drawings.board_drawing import contact_sheet
from sitscad.files.drawing.pictures import layout_picture as board_picture
from sitscad.files.drawing.sheet import Label
from sitscad.files.formats import gerber, ipc356, laser
from sitscad.files.formats.gerber import panel_files as panel
from sitscad.files.formats.kicad import project_files as kicad_board
from sitscad.files.writer import Package
from sitscad.layout.laser_sheet import laser_sheets
from sitscad.layout.panel import plan
from sitscad.package.contents import incoming_tests, nominal_calibration
from sitscad.spec import templates
from sitscad.spec.circuit import PanelSpec
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError
from sitscad.spec.yaml.source import Issue

ISSUE = Issue("B.2", "TS-104 (a)", "2026-11-22")
SPEC = """\
sitscad: 1
name: issued
{head}
coil: {{shape: circle, outer_diameter: 10, turns: 12.5, layers: 2, trace_width: 150 um, trace_spacing: 150 um}}
target: {{shape: square, size: 10, thickness: 0.2, material: copper}}
"""


def _issued(layout, issue=ISSUE):
    return replace(layout, spec=replace(layout.spec, issue=issue))


def _labels(sheet):
    return [item.text for item in sheet.items if isinstance(item, Label)]


@pytest.fixture
def issued(board):
    return _issued(board)


def test_every_title_block_has_part_number_revision_and_date(issued):
    spec = replace(issued.spec, fpc=replace(issued.spec.fpc, panel=PanelSpec("always")))
    sheets = [
        board_drawing.board_sheet(issued, "x"),
        contact_sheet(issued, "x"),
        stackup_drawing.stackup_sheet(issued, "x"),
        panel_drawing.panel_sheet(plan(replace(issued, spec=spec)), "x"),
    ]
    for sheet in sheets:
        labels = _labels(sheet)
        for label, text in (("Part no.", "TS-104 (a)"), ("Rev.", "B.2"), ("Date", "2026-11-22")):
            assert labels[labels.index(label) + 1] == text


def test_title_block_without_issue_says_not_stated(board):
    labels = _labels(board_drawing.board_sheet(board, "x"))
    assert [labels[labels.index(label) + 1] for label in ("Part no.", "Rev.", "Date")] == ["not stated"] * 3


def test_readmes_state_part_number_revision_and_date(issued):
    text = fabrication_notes.order_readme(issued)
    assert re.search(r"Part number +TS-104 \(a\)\nRevision +B\.2\nDate +2026-11-22\n", text)
    spec = replace(issued.spec, fpc=replace(issued.spec.fpc, panel=PanelSpec("always")))
    words = panel_drawing.panel_readme(plan(replace(issued, spec=spec)), None)
    assert "Part number: TS-104 (a)\nRevision: B.2\nDate: 2026-11-22\n" in words


@pytest.mark.slow
def test_assembly_laser_and_calibration_files_state_issue(issued):
    """Their revision was promised in docs/spec.md, and missing."""
    design = Design(load_text(templates.read("bench_7mm"), "t.yaml"))
    spec = replace(design.spec, issue=ISSUE)
    layout, title = replace(design.layout, spec=spec), "Part number TS-104 (a), revision B.2, 2026-11-22."
    (cut,) = laser_notes.render(layout).values()
    package = Package({}, frozenset())
    (steps,) = assembly_notes.render(layout, design.estimates, incoming_tests(design).board, "", package).values()
    assert cut.decode().splitlines()[1] == steps.decode().splitlines()[1] == title
    files = nominal_calibration(Design(spec, layout, design.estimates))
    assert files["calibration/plan.txt"].decode().splitlines()[1] == title
    assert f"<p class='soft'>{ISSUE.words}</p>" in files["calibration/calibration.html"].decode()


def test_gerber_drill_and_job_files_contain_issue(issued, tmp_path):
    gerbonara = pytest.importorskip("gerbonara")
    files = gerber.render(issued) | gerber.render_drills(issued) | gerber.render_drill_map(issued)
    for path, content in files.items():
        assert b"TF.ProjectId,two-coils," in content and b",B.2" in content
        assert b"part number TS-104 (a), revision B.2, 2026-11-22" in content
        target = tmp_path / path.rpartition("/")[2]
        target.write_bytes(content)
        with warnings.catch_warnings():
            warnings.simplefilter("error", SyntaxWarning)
            kind = gerbonara.ExcellonFile if path.endswith(".drl") else gerbonara.GerberFile
            assert kind.open(target).objects or "B_Mask" in path
    (job,) = gerber.render_job(issued).values()
    assert json.loads(job)["GeneralSpecs"]["ProjectId"]["Revision"] == "B.2"


def test_panel_images_contain_issue(issued):
    spec = replace(issued.spec, fpc=replace(issued.spec.fpc, panel=PanelSpec("always")))
    whole = plan(replace(issued, spec=spec))
    made = panel.render(whole, gerber.render(issued) | gerber.render_drills(issued))
    images = [content for path, content in made.items() if path.endswith((".gbr", ".drl"))]
    assert images and all(b"revision B.2" in content and b",B.2" in content for content in images)


def test_netlist_contains_issue_and_is_readable(issued):
    ipc = pytest.importorskip("gerbonara.ipc356")
    (content,) = ipc356.render(issued).values()
    lines = content.decode("ascii").splitlines()
    assert "P  NUM   TS-104 (a)" in lines and "P  REV   B.2" in lines
    assert "C  Part number TS-104 (a), revision B.2, 2026-11-22" in lines
    assert max(map(len, lines)) <= 80
    result = ipc.Netlist.from_string(content.decode("ascii"), filename="x.d356")
    assert len(result.test_records) == len(issued.pads) + len(issued.vias)


def test_kicad_title_block_contains_issue(issued):
    text = kicad_board.board_text(issued)
    block = text[text.index("(title_block") : text.index("(layers")]
    assert '(date "2026-11-22")' in block and '(rev "B.2")' in block and '"part number TS-104 (a)"' in block


def test_pictures_parts_list_and_laser_sheets_contain_issue(issued):
    words = "part number TS-104 (a), revision B.2, 2026-11-22"
    picture = board_picture.layout_svg(issued)
    rows = re.findall(r"<text transform='translate\([0-9.]+ ([0-9.]+)\)'[^>]*>(.*?)</text>", picture)
    (own,) = [height for height, row in rows if words in row]
    assert [row for height, row in rows if height == own] == [words]
    layout = _issued(replace(issued, spec=load_text(SPEC.format(head=""))))
    (sheet,) = laser_sheets(layout)
    assert words in [text for _, text in sheet.notes]
    assert words in laser.svg_drawing(sheet, "issued")
    for _, text in sheet.notes:
        assert len(text) * 0.8 * 1.2e-3 < sheet.width

    class Chosen:
        capacitance, capacitance_reason = 1e-10, ""

    class Estimates:
        readout = Chosen()

    rows = list(csv.DictReader(io.StringIO(bom.render(issued, Estimates())["bom.csv"].decode())))
    assert words in rows[0]["note"]


def test_issue_is_read_from_spec_as_text():
    spec = load_text(SPEC.format(head='revision: "1.10"\npart_number: A-17\ndate: 2026-11-22'))
    assert spec.issue == Issue("1.10", "A-17", "2026-11-22")
    assert load_text(SPEC.format(head="")).issue == Issue()


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("revision: 1.10", "put quotes around it"),
        ("revision: B*", "letters, digits, spaces"),
        ("part_number: 'a,b'", "letters, digits, spaces"),
        ("part_number: '%x'", "letters, digits, spaces"),
        ("revision: Seventeen letters", "17 characters are too many: at most 16"),
        ("part_number: " + 33 * "1a"[:1] + "a", "34 characters are too many: at most 32"),
        ("date: '2026-11-22\\n'", "letters, digits, spaces"),
        ("date: d\u00e9cembre", "letters, digits, spaces"),
    ],
)
def test_invalid_issue_text_gives_spec_error(head, said):
    with pytest.raises(SpecError) as refused:
        load_text(SPEC.format(head=head))
    (finding,) = refused.value.findings
    assert said in f"{finding.message} {finding.hint}" and finding.line == 3


def test_default_date_is_source_date_epoch(board, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert _issued(board, Issue("B")).spec.issue.words == "revision B, 1970-01-02"
    assert '(date "1970-01-02")' in kicad_board.board_text(_issued(board, Issue()))
    assert ISSUE.day == "2026-11-22"
