"""`verify` reads back what is ordered: every board on the panel, its coupons and its frame, whatever the hashes say."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import time
import zipfile

import pytest

import sitscad
from sitscad.cli import main

pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")
from sitscad.files.extraction.artwork import ExtractionError
from sitscad.files.extraction.panel_comparison import compare_panel

SPEC = """
sitscad: 1
name: small-part
coil: {shape: circle, outer_diameter: 3.5, turns: 6.5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}
array: {pattern: line, count: 2, pitch: 4}
fpc:
  tail: {length: 30, connector: zif-0.5mm}
  panel: {parts: %s}
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    spec = sitscad.load_text(SPEC % "[2, 3]", "small.yaml")
    return sitscad.build(spec, tmp_path_factory.mktemp("panel"), ["gerber"], force=True).directory


@pytest.fixture
def package(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / whole.name)


def changed(package, name, change):
    """What is found of the panel once one of its files is changed."""
    path = package / "fpc/panel" / f"small-part-panel{name}"
    text = path.read_text()
    path.write_text(change(text))
    assert path.read_text() != text
    try:
        return "\n".join(compare_panel(package / "fpc", package / "fpc/panel")[1])
    except ExtractionError as error:
        return str(error)


def first_size(text, change):
    """The list of places with the panel's width changed."""
    return re.sub(r'(?<="size": \[)(\s+)([\d.]+)', lambda found: found[1] + change(found[2]), text, count=1)


def without_last_part(text):
    """The list of places without its last board."""
    return re.sub(r'("parts": .*?),\s+\[[^\[\]]*\](\s+\],\s+"coupons")', r"\1\2", text, count=1, flags=re.DOTALL)


def without(number, pattern):
    """A change that takes away the n-th line that matches."""

    def change(text):
        result = list(re.finditer(pattern, text, re.MULTILINE))
        return text[: result[number].start()] + text[result[number].end() :]

    return change


def drawn(commands):
    return lambda text: text.replace("M02*", f"%ADD99C,0.2*%\nD99*\nG01*\n{commands}\nM02*")


@pytest.mark.slow
def test_intact_panel_passes_verification(whole):
    result = sitscad.verify(whole)
    assert (result.differences, result.panel_boards) == ((), 6)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("-PTH.drl", without(2, r"^X.*\n"), ["PTH.drl, board 1 is not as the single board", "1 objects missing"]),
        ("-PTH.drl", without(-1, r"^X.*\n"), ["PTH.drl, coupon 2 is not as the first coupon"]),
        ("-PTH.drl", lambda t: t.replace("T1C0.200", "T1C0.150"), ["board 1", "board 6"]),
        ("-B_Cu.gbr", without(-9, r"^X.*D01\*\n"), ["B_Cu.gbr"]),
        ("-F_Cu.gbr", without(40, r"^X.*D01\*\n"), ["F_Cu.gbr, board 1 is not as the single board"]),
        ("-F_Mask.gbr", without(0, r"^X.*D01\*\n"), ["F_Mask.gbr, board 1 is not as the single board"]),
        ("-F_Cu.gbr", drawn("X5000000Y20000000D02*\nX80000000Y20000000D01*"), ["belong to no board"]),
        ("-NPTH.drl", lambda t: t.replace("M30", "X30.0Y21.0\nM30"), ["NPTH.drl shows what", "x 30 mm, y 21 mm"]),
        ("-Part_Cuts.gbr", drawn("X30000000Y15000000D02*\nX31000000Y15000000D01*"), ["Part_Cuts.gbr"]),
        ("-Part_Cuts.gbr", lambda t: t.replace("D01*", "D02*"), ["coupon is not cut out"]),
        (
            "-F_Cu.gbr",
            without(0, r"^X7500000Y2500000D03\*\n"),
            ["F_Cu.gbr lacks a mark of the list, first at x 7.5 mm, y 2.5 mm"],
        ),
        ("-B_Mask.gbr", drawn("X30000000Y2500000D03*"), ["B_Mask.gbr shows what the list does not have"]),
        ("-F_Cu.gbr", drawn("%LPC*%\nX30000000Y20000000D03*"), ["F_Cu.gbr has doubled or clear objects"]),
        ("-NPTH.drl", without(0, r"^X2.5Y2.5\n"), ["NPTH.drl lacks a mark of the list, first at x 2.5 mm, y 2.5 mm"]),
        ("-NPTH.drl", lambda t: t.replace("X2.5Y2.5\n", 2 * "X2.5Y2.5\n"), ["NPTH.drl has doubled or clear objects"]),
        ("-NPTH.drl", lambda t: t.replace("C1.500", "C1.600"), ["NPTH.drl shows what the list does not have"]),
        ("-NPTH.drl", lambda t: t.replace("C1.500", "C1.400"), ["NPTH.drl lacks a mark of the list"]),
        ("-Part_Cuts.gbr", lambda t: t.replace("C,0.05", "C,0.15"), ["board 1: the cut leaves the board's outline"]),
        ("-Edge_Cuts.gbr", without(-1, r"^X.*D01\*\n"), ["the panel's outline is not"]),
        (".json", lambda t: t.replace('"size": [', '"size": [ 1e300, 1e300], "was": ['), ["is no list of places"]),
        (".json", lambda t: first_size(t, lambda width: f"{float(width) + 1:g}"), ["the panel's outline is not"]),
        (".json", without_last_part, ["F_Cu.gbr has objects that belong to no board", "PTH.drl shows"]),
    ],
)
def test_change_on_panel_alone_is_found(package, name, change, words):
    message = changed(package, name, change)
    assert all(word in message for word in words), message


def test_missing_panel_hole_is_found_despite_correct_hash(package):
    message = changed(package, "-PTH.drl", without(2, r"^X.*\n"))
    name = "fpc/panel/small-part-panel-PTH.drl"
    manifest = json.loads((package / "manifest.json").read_text())
    manifest["files"][name]["sha256"] = hashlib.sha256((package / name).read_bytes()).hexdigest()
    (package / "manifest.json").write_text(json.dumps(manifest))
    result = sitscad.verify(package)
    sent = "fpc/small-part-order.zip: small-part-panel-PTH.drl is not as the file beside it"
    assert result.differences == (sent, *message.splitlines())
    assert (result.wrong_nets, result.wrong_archive, result.wrong_boards) == (0, 1, len(message.splitlines()))


def test_coupon_without_holes_in_every_place_is_found(package):
    """Its holes taken from both coupons: they are like each other still, but no coil."""
    boards, coupons = 4 * 6, 1
    text = (package / "fpc/panel/small-part-panel-PTH.drl").read_text()
    holes = re.findall(r"^X.*\n", text, re.MULTILINE)
    assert len(holes) > boards + coupons
    message = changed(package, "-PTH.drl", lambda t: t.replace("".join(holes[boards:]), ""))
    assert "the panel's coupon: no-hole" in message and "the panel's coupon: open" in message


def cut_paths(text):
    """The cuts of a file, each a line from its first point to its last, as (whole text, start, end)."""
    result = []
    for run in re.finditer(r"^(X-?\d+Y-?\d+)D02\*\n(?:(?!.*D02).*D01\*\n|G0[123]\*\n)+", text, re.MULTILINE):
        result.append((run[0], run[1], re.findall(r"^(X-?\d+Y-?\d+)", run[0], re.MULTILINE)[-1]))
    return result


@pytest.mark.parametrize("which", range(3))
def test_cut_missing_on_all_boards_is_found(package, which):
    """What no copy has, no comparison of copies finds: the cuts are held against the listed bridges."""
    text = (package / "fpc/panel/small-part-panel-Part_Cuts.gbr").read_text()
    boards = 6
    each = len([path for path in cut_paths(text)]) // (boards + 2)
    doomed = [cut_paths(text)[board * each + which][0] for board in range(boards)]

    def change(text):
        for cut in doomed:
            assert cut in text
            text = text.replace(cut, "", 1)
        return text

    message = changed(package, "-Part_Cuts.gbr", change)
    assert "board 1: cut and bridges do not close an outline" in message and "is not as" not in message


@pytest.mark.slow
def test_bridge_missing_on_all_boards_is_found(package):
    """Every bridge cut through: the boards are alike, and fall out."""

    def change(text):
        pairs = zip(cuts, [*cuts[1:], cuts[0]], strict=True)
        bridged = [f"{end}D02*\n{begin}D01*" for (_, _, end), (_, begin, _) in pairs]
        return drawn("\n".join(bridged))(text)

    cuts = cut_paths((package / "fpc/panel/small-part-panel-Part_Cuts.gbr").read_text())
    assert "board 1: the cut goes into the bridge at" in changed(package, "-Part_Cuts.gbr", change)


@pytest.mark.slow
def test_bridge_cut_in_both_directions_is_found(package):
    """The cut then ends where it did, and nothing holds the boards."""

    def change(text):
        pairs = zip(cuts, [*cuts[1:], cuts[0]], strict=True)
        lines = [f"{end}D02*\n{begin}D01*\n{end}D01*" for (_, _, end), (_, begin, _) in pairs]
        return drawn("\n".join(lines))(text).replace("%ADD99C,0.2*%", "%ADD99C,0.05*%")

    cuts = cut_paths((package / "fpc/panel/small-part-panel-Part_Cuts.gbr").read_text())
    assert "board 1: the cut goes into the bridge at" in changed(package, "-Part_Cuts.gbr", change)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: first_size(text, lambda _: "1" + 400 * "0"),
        lambda text: 100_000 * "[",
        lambda text: text.replace('"mm"', '"inch"'),
        lambda text: text.replace('"unit": "mm",', ""),
    ],
    ids=["a number of 401 digits", "brackets without end", "inches", "no unit"],
)
def test_invalid_list_of_places_gives_error(package, change):
    assert "is no list of places" in changed(package, ".json", change)


def test_missing_panel_file_is_found(package):
    (package / "fpc/panel/small-part-panel-B_Mask.gbr").unlink()
    message = "\n".join(compare_panel(package / "fpc", package / "fpc/panel")[1])
    assert "the panel has nothing like small-part-B_Mask.gbr" in message


@pytest.mark.slow
def test_body_layers_are_on_rails_and_not_between_boards(tmp_path):
    text = (SPEC % "[1, 2]").replace("3.5, turns: 6.5, layers: 2", "4, turns: 5.75, layers: 4").replace("0.1", "80 um")
    text = text.replace("pitch: 4", "pitch: 4.5").replace("fpc:", "fpc:\n  stackup: flex-4l\n  rules: generic-fine")
    spec = sitscad.load_text(text.replace("0.5mm}", "0.5mm, layers: 2}"), "four.yaml")
    package = sitscad.build(spec, tmp_path, ["gerber"], force=True).directory
    assert compare_panel(package / "fpc", package / "fpc/panel") == (2, ())
    message = changed(package, "-Body_Layers.gbr", without(0, r"G36\*\n(?:[XG].*\n)*?G37\*\n"))
    assert message
    area = "G36*\nX0Y0D02*\nG01*\nX20000000Y0D01*\nX20000000Y15000000D01*\nX0Y15000000D01*\nX0Y0D01*\nG37*\nM02*"
    message = changed(package, "-Body_Layers.gbr", lambda text: text.replace("M02*", area))
    assert "small-part-panel-Body_Layers.gbr shows what the list does not have" in message


def test_verification_summary_counts_differences(package, capsys):
    hole = package / "fpc/small-part-PTH.drl"
    hole.write_text(without(0, r"^X.*\n")(hole.read_text()))
    (package / "estimate.json").unlink()
    (package / "notes.txt").write_text("not from here")
    with pytest.raises(SystemExit) as stop:
        main(["verify", str(package)])
    lines = capsys.readouterr().out.splitlines()
    count = len(json.loads((package / "manifest.json").read_text())["files"])
    assert stop.value.code == 1
    assert len([line for line in lines if line.startswith("no-hole")]) == 1
    assert lines[-1] == (
        f"differs: {count} files against the manifest (1 missing, 1 changed, 1 not in the manifest), "
        "the copper of the Gerber files is not that of nets C1, C2, the order archive made of the files beside it, "
        "the panel is not made of the single board, built in spite of errors and not for order"
    )


def test_every_drawing_in_forced_archive_is_stamped(whole):
    with zipfile.ZipFile(whole / "fpc/small-part-order.zip") as archive:
        drawings = [name for name in archive.namelist() if name.endswith(".pdf")]
        assert len(drawings) == 3
        for name in drawings:
            assert b"MADE IN SPITE OF ERRORS, NOT FOR ORDER" in archive.read(name), name


@pytest.mark.slow
def test_verification_of_200_boards_takes_under_6_seconds(tmp_path):
    spec = sitscad.load_text(SPEC % "[10, 20]", "small.yaml")
    folder = sitscad.build(spec, tmp_path, ["gerber"], force=True).directory
    began = time.process_time()
    result = sitscad.verify(folder)
    assert (result.ok, result.panel_boards) == (True, 200)
    assert time.process_time() - began < 6.0


def test_package_without_panel_passes_verification(tmp_path):
    spec = sitscad.load_text(SPEC.replace("{parts: %s}", "none"), "small.yaml")
    built = sitscad.build(spec, tmp_path, ["gerber"], force=True)
    read = sitscad.verify(built.directory)
    assert (read.differences, read.panel_boards) == ((), None)
