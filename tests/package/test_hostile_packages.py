"""A package from a stranger is read back soon, in little memory, and prints nothing that steers a terminal."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
import struct
import time
import zipfile

import pytest

import sitscad
from sitscad.checks.findings.document import read_findings
from sitscad.cli import main
from sitscad.files.extraction import limits
from sitscad.package.manifest import MANIFEST
from sitscad.spec import templates

pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")

COPPER, HOLES, NETLIST, JOB, ORDER = (
    f"fpc/single-coil-{name}" for name in ("F_Cu.gbr", "PTH.drl", "netlist.d356", "job.gbrjob", "order.zip")
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    spec = sitscad.load_text(templates.read("single_coil"), "single_coil.yaml")
    return sitscad.build(spec, tmp_path_factory.mktemp("hostile"), ["gerber"]).directory


@pytest.fixture
def package(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / whole.name)


def _inserted(name, text, before="M02*"):
    """Put a text into a file, before the first place of another."""

    def change(package):
        content = (package / name).read_text()
        assert before in content
        (package / name).write_text(content.replace(before, text + before, 1))

    return change


def _written(name, content):
    def change(package):
        (package / name).write_bytes(content.encode() if isinstance(content, str) else content)

    return change


def _crossing(count):
    """Draws from side to side, each across all others."""
    ends = (f"X0Y{k * 1000}D02*\nX90000000Y{(count - k) * 1000}D01*\n" for k in range(count))
    return "D10*\nG01*\n" + "".join(ends)


def _overlapping_zip():
    """An archive whose thousand entries are one and the same megabyte."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("0", b"\0" * 1_000_000)
    content = stream.getvalue()
    at = content.index(b"PK\x01\x02")
    entry, end = content[at:-22], bytearray(content[-22:])
    end[8:12] = struct.pack("<HH", 1000, 1000)
    end[12:16] = struct.pack("<I", len(entry) * 1000)
    return content[:at] + entry * 1000 + bytes(end)


HOSTILE = {
    "step and repeat": _inserted(COPPER, "%SRX30000Y30000I0.1J0.1*%\nX0Y0D03*\n%SR*%\n"),
    "step and repeat as a word": _inserted(COPPER, "SRX30000Y30000I0.1J0.1*\n"),
    "a block": _inserted(COPPER, "%ABD99*%\nX0Y0D03*\n%AB*%\n"),
    "a polygon": _inserted(COPPER, "%ADD99P,1X99999999*%\nD99*\nX0Y0D03*\n"),
    "a polygon in a macro": _inserted(COPPER, "%AMBIG*5,1,99999999,0,0,1,0*%\n%ADD99BIG*%\nD99*\nX0Y0D03*\n"),
    "a polygon by a parameter": _inserted(COPPER, "%AMBIG*5,1,$1,0,0,1,0*%\n%ADD99BIG,99999999*%\nD99*\nX0Y0D03*\n"),
    "a division by nothing": _inserted(COPPER, "%AMBIG*1,1,1/0,0,0*%\n%ADD99BIG*%\nD99*\nX0Y0D03*\n"),
    "an undefined aperture": _inserted(COPPER, "D99*\nX0Y0D03*\n"),
    "a far arc": _inserted(COPPER, "D10*\nG75*\nX0Y0D02*\nG02*\nX1000Y1000I9999999999J9999999999D01*\n"),
    "a large arc": _inserted(COPPER, "D10*\nG75*\nX0Y0D02*\nG02*\nX1000Y1000I99999999999999999J0D01*\n"),
    "a far place": _inserted(COPPER, "D10*\nX99999999999999999999Y0D03*\n"),
    "many lines across": _inserted(COPPER, _crossing(3000)),
    "many flashes": _inserted(COPPER, "D10*\n" + "X0Y0D03*\n" * 15_000),
    "more flashes": _inserted(COPPER, "D10*\n" + "X0Y0D03*\n" * 110_000),
    "many holes": _inserted(HOLES, "T1\n" + "X1.0Y1.0\n" * 310_000, "M30"),
    "many arcs": _inserted(COPPER, "D10*\nG75*\nG02*\n" + "X0Y0D02*\nX0Y0I2000000000J0D01*\n" * 2_000),
    "a statement without an end": _inserted(COPPER, "X" * 3_000_000),
    "layer of many digits": _written("fpc/more.gbr", "%TF.FileFunction,Copper,L99999999999999999999,Bot*%\nM02*\n"),
    "layer of nine digits": _written("fpc/more.gbr", "%TF.FileFunction,Copper,L999999999,Bot*%\nM02*\n"),
    "extent of a far layer": _written("fpc/more.gbr", "%TF.FileFunction,Other,Extent_of_L999999999*%\nM02*\n"),
    "repeated holes": _inserted(HOLES, "T1\nR9999999X1.0\n", "M30"),
    "a hole of many digits": _inserted(HOLES, "T1\nX99999999999999999999Y0\n", "M30"),
    "a netlist of many digits": _inserted(NETLIST, f"317{'9' * 5000}\n", "999"),
    "many marks": _inserted(NETLIST, "317C1               VIA   -    MD0200PA00X+000000Y+000000\n" * 110_000, "999"),
    "a deep job": _written(JOB, "[" * 200_000),
    "a job of many digits": _written(JOB, '{"FilesAttributes": ' + "9" * 100_000 + "}"),
    "an archive that unpacks to more": _written(ORDER, _overlapping_zip()),
    "an archive of noise": _written(ORDER, b"PK\x03\x04" + bytes(range(256)) * 100),
}
"""Changes to files after which reading took minutes or gigabytes, or ended in a traceback."""


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_file_gives_difference_within_25_seconds(package, what, monkeypatch):
    HOSTILE[what](package)
    monkeypatch.setattr(limits, "MAX_POINTS", limits.MAX_POINTS // 20)  # at which files take half a minute
    began = time.process_time()
    result = sitscad.verify(package)
    assert time.process_time() - began < 25.0
    beyond_hashes = [words for words in result.differences if "SHA-256" not in words and "manifest" not in words]
    assert beyond_hashes, result.differences


@pytest.mark.parametrize("name", [COPPER, HOLES, JOB, "fpc/more.json", "spec/single_coil.yaml", "fpc/FORCED.txt"])
def test_named_pipe_in_place_of_file_is_difference(package, name):
    (package / name).unlink(missing_ok=True)
    os.mkfifo(package / name)
    assert not sitscad.verify(package).ok


@pytest.mark.parametrize("content", [
    None, "[" * 200_000, '{"a": 1, "a": 2}', "9" * 100_000, " " * 17_000_000,
])
def test_hostile_manifest_gives_package_error(package, content):
    """A pipe if there is no content."""
    (package / MANIFEST).unlink()
    if content is None:
        os.mkfifo(package / MANIFEST)
    else:
        (package / MANIFEST).write_text(content)
    with pytest.raises(sitscad.PackageError):
        sitscad.verify(package)


@pytest.mark.parametrize("names", [
    ["../x"], ["/etc/passwd"], ["a/../../x"], ["a\\b"], ["a\nb"], ["\x1b[2J"], [""], ["a", "A"], ["fpc/x", "FPC/X"],
])
def test_manifest_with_unsafe_or_equal_names_gives_package_error(package, names):
    document = json.loads((package / MANIFEST).read_text())
    document["files"] |= {name: {"sha256": "0", "stage": "kicad", "made_from": "0"} for name in names}
    (package / MANIFEST).write_text(json.dumps(document))
    with pytest.raises(sitscad.PackageError):
        sitscad.verify(package)


def test_file_beyond_size_limit_gives_package_error(package, monkeypatch):
    with (package / "fpc" / "huge.bin").open("wb") as stream:
        stream.truncate(10**12)
    with pytest.raises(sitscad.PackageError):
        sitscad.verify(package)


def test_exchanged_order_archive_is_found_despite_other_manifest_name(package):
    """The archive is looked for under the name of the spec, not of the manifest."""
    (package / ORDER).write_bytes(b"of somebody else")
    document = json.loads((package / MANIFEST).read_text())
    document["spec"]["name"] = "other"
    document["files"][ORDER]["sha256"] = hashlib.sha256(b"of somebody else").hexdigest()
    (package / MANIFEST).write_text(json.dumps(document))
    result = sitscad.verify(package)
    assert any(words.startswith(MANIFEST) for words in result.differences)
    assert any(words.startswith(ORDER) for words in result.differences)


def test_missing_layer_in_order_archive_is_found_despite_other_stage(package):
    with zipfile.ZipFile(package / ORDER) as archive:
        contents = {name: archive.read(name) for name in archive.namelist() if not name.endswith(".GBL")}
    with zipfile.ZipFile(package / ORDER, "w") as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    document = json.loads((package / MANIFEST).read_text())
    document["files"]["fpc/single-coil-B_Cu.gbr"]["stage"] = "kicad"
    (package / MANIFEST).write_text(json.dumps(document))
    assert any("single-coil.GBL is missing" in words for words in sitscad.verify(package).differences)


STEERING = "\x1b]0;title\x07\x1b[2Jok: all\rfine\u202e"


def _a_name(package):
    (package / f"fpc/{STEERING}\n").write_text("x")


def _a_net(package):
    document = json.loads((package / MANIFEST).read_text())
    document["nets"][f"{STEERING}\nok: "] = ["1"]
    (package / MANIFEST).write_text(json.dumps(document))


def _a_version(package):
    document = json.loads((package / MANIFEST).read_text())
    document["sitscad"] = STEERING
    (package / MANIFEST).write_text(json.dumps(document))


def _a_member(package):
    with zipfile.ZipFile(package / ORDER, "a") as archive:
        archive.writestr(STEERING, b"x")


def _a_file_function(package):
    (package / "fpc/more.gbr").write_text(f"%TF.FileFunction,Copper,{STEERING}*%\nM02*\n")


def _a_job(package):
    text = (package / JOB).read_text()
    (package / JOB).write_text(text.replace("single-coil-F_Cu.gbr", json.dumps(STEERING + "\nok")[1:-1]))


def _a_spec(package):
    text = (package / "spec/single_coil.yaml").read_text()
    (package / "spec/single_coil.yaml").write_text(text.replace("name: single-coil", f"name: {json.dumps(STEERING)}"))


@pytest.mark.parametrize("change", [_a_name, _a_net, _a_version, _a_member, _a_file_function, _a_job, _a_spec])
@pytest.mark.parametrize("rebuilds", [False, True], ids=["", "rebuilt"])
def test_package_text_with_control_characters_is_printed_escaped(package, change, rebuilds, capsys):
    change(package)
    with pytest.raises(SystemExit) as stop:
        main(["verify", str(package), *(["--rebuild"] if rebuilds else [])])
    message = "".join(capsys.readouterr())
    assert all(letter.isprintable() or letter == "\n" for letter in message), message
    if change is not _a_version or rebuilds:  # the version counts for building again alone
        assert stop.value.code != 0 and not any(line.startswith("ok") for line in message.splitlines())


@pytest.mark.parametrize("limit", ["MAX_BYTES", "MAX_STATEMENT", "MAX_OBJECTS", "MAX_POINTS", "MAX_PAIRS"])
def test_largest_board_stays_far_below_every_limit(package, monkeypatch, limit):
    """A template's board stays within a fiftieth of each limit, but for the length of statements."""
    share = 4 if limit == "MAX_STATEMENT" else 50
    monkeypatch.setattr(limits, limit, getattr(limits, limit) // share)
    assert sitscad.verify(package).ok


DEEP = "[" * 200_000


@pytest.mark.parametrize("content", [DEEP, '{"specs": [5]}', '{"specs": ["x"]}', '{"specs": [{"ignored": [5]}]}'])
def test_invalid_findings_file_is_ignored(content):
    """A build that has nothing to do reads what the checks of the package found."""
    assert read_findings(content.encode(), "small.yaml", "") is None
