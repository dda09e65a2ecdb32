"""A package that was changed by somebody who wrote its hashes anew: what is built again from its spec finds it, and
much of it shows without that.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import zipfile
from dataclasses import replace

import pytest

import sitscad
from sitscad.cli import main
from sitscad.package import stages, verification
from sitscad.package.manifest import MANIFEST, Entry, read_manifest, sha256
from sitscad.spec import templates

pytest.importorskip("gerbonara", reason="reading Gerber files back needs gerbonara")

STEM = "fpc/single-coil-"
SPEC = "spec/single_coil.yaml"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    spec = sitscad.load_text(templates.read("single_coil"), "single_coil.yaml")
    return sitscad.build(spec, tmp_path_factory.mktemp("forged"), ["gerber"]).directory


@pytest.fixture(scope="module")
def made_once():
    """Return `make_stages` with a cache: a table of changes builds one spec under one policy again and again."""
    stored, real = {}, stages.make_stages

    def make_stages(contents, directory, old, wanted, *rest, **how):
        key = (contents.design.spec.source.text, json.dumps(contents.policy.as_json()), wanted)
        if key not in stored:
            stored[key] = real(contents, directory, old, wanted, *rest, **how)
        return stored[key]

    return make_stages


@pytest.fixture
def package(whole, tmp_path, monkeypatch, made_once):
    monkeypatch.setattr(stages, "make_stages", made_once)
    return shutil.copytree(whole, tmp_path / whole.name)


def signed(package):
    """The manifest written anew for the files as they are; what is gone goes out of it, what is new comes in."""
    manifest = read_manifest(package)
    there = {path.relative_to(package).as_posix(): path for path in package.rglob("*") if path.is_file()}
    files = {
        name: replace(manifest.files.get(name, Entry("", "gerber", "0")), sha256=sha256(path.read_bytes()))
        for name, path in there.items()
        if name != MANIFEST
    }
    spec = {**manifest.spec, "sha256": files[SPEC].sha256} if SPEC in files else manifest.spec
    (package / MANIFEST).write_bytes(replace(manifest, files=files, spec=spec).as_bytes())


def rewritten(name, old, new, count=1):
    def change(package):
        path = package / name
        text = path.read_bytes().decode("latin-1")
        assert old in text, (name, old)
        path.write_bytes(text.replace(old, new, count).encode("latin-1"))

    return name, change


def swapped(one, other):
    def change(package):
        a, b = (package / f"{STEM}{name}" for name in (one, other))
        stored = a.read_bytes()
        a.write_bytes(b.read_bytes())
        b.write_bytes(stored)

    return f"{STEM}{one}", change


def swapped_drawings(one, other):
    """What two layers draw exchanged, and what each says that it is left: no attribute is wrong."""

    def change(package):
        paths = [package / f"{STEM}{name}" for name in (one, other)]
        (head, body), (other_head, other_body) = (path.read_text().split("%LPD*%", 1) for path in paths)
        paths[0].write_text(f"{head}%LPD*%{other_body}")
        paths[1].write_text(f"{other_head}%LPD*%{body}")

    return f"{STEM}{one}", change


def removed(name):
    return name, lambda package: (package / name).unlink()


def added(name):
    return name, lambda package: (package / name).write_bytes(b"M02*\n")


def member(change):
    """The order's archive with its files changed, packed as it was."""

    def of(package):
        path = package / f"{STEM}order.zip"
        with zipfile.ZipFile(path) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w") as archive:
            for name, content in change(files).items():
                archive.writestr(zipfile.ZipInfo(name), content)
        path.write_bytes(made.getvalue())

    return f"{STEM}order.zip", of


def exchanged(files, one, other):
    return {**files, one: files[other], other: files[one]}


def without(files, name):
    return {each: content for each, content in files.items() if each != name}


def of_manifest(change):
    def of(package):
        document = json.loads((package / MANIFEST).read_text())
        change(document)
        (package / MANIFEST).write_text(json.dumps(document, indent=1) + "\n")

    return MANIFEST, of


CU, DRILL = f"{STEM}F_Cu.gbr", f"{STEM}PTH.drl"
ZIP = "single-coil"
CHANGES = {
    "copper layers exchanged": swapped("F_Cu.gbr", "B_Cu.gbr"),
    "what copper layers draw exchanged": swapped_drawings("F_Cu.gbr", "B_Cu.gbr"),
    "coverlays exchanged": swapped("F_Mask.gbr", "B_Mask.gbr"),
    "a copper layer called the other": rewritten(CU, "Copper,L1,Top", "Copper,L2,Bot"),
    "tracks of 140 um": rewritten(CU, "C,0.16*", "C,0.14*"),
    "a drill of 0.44 mm": rewritten(DRILL, "T1C0.200", "T1C0.440"),
    "a hole moved by 10 um": rewritten(DRILL, "X0.295", "X0.305"),
    "layers of the job exchanged": rewritten(f"{STEM}job.gbrjob", "F_Cu.gbr", "X_Cu.gbr"),
    "a netlist's drill": rewritten(f"{STEM}netlist.d356", "D0200", "D0300"),
    "the readme's finish": rewritten("fpc/readme.txt", "ENIG", "HASL"),
    "a drawing's last byte": rewritten(f"{STEM}drawing.pdf", "%%EOF", "%%EOG"),
    "an order without its netlist": member(lambda files: without(files, f"{ZIP}-netlist.d356")),
    "layers of the order exchanged": member(lambda files: exchanged(files, f"{ZIP}.GTL", f"{ZIP}.GBL")),
    "a drill of the order": member(
        lambda files: {**files, f"{ZIP}-PTH.drl": files[f"{ZIP}-PTH.drl"].replace(b"0.200", b"0.440")}
    ),
    "a note in the order": member(lambda files: {**files, "note.txt": b"make it thinner"}),
    "a readme of the order": member(
        lambda files: {**files, "readme.txt": files["readme.txt"].replace(b"ENIG", b"HASL")}
    ),
    "an order that is none": rewritten(f"{STEM}order.zip", "PK", "KP", 99),
    "turns of the spec": rewritten(SPEC, "turns: 13 ", "turns: 12 "),
    "a comment of the spec": rewritten(SPEC, "# across", "# over"),
    "findings": rewritten("findings.json", '"ok": true', '"ok": false'),
    "an estimate": rewritten("estimate.json", "1", "2"),
    "a file taken out": removed("estimate.json"),
    "a layer taken out": removed(f"{STEM}B_Mask.gbr"),
    "the archive taken out": removed(f"{STEM}order.zip"),
    "all but the spec taken out of fpc": removed(f"{STEM}job.gbrjob"),
    "a file of another": added("fpc/single-coil-In1_Cu.gbr"),
    "nets of the manifest": of_manifest(lambda document: document["nets"].update(C1=["C1.A"])),
    "a package that is called forced": of_manifest(lambda document: document.update(forced=True)),
    "what a stage was made from": of_manifest(lambda document: document["files"][CU].update(made_from="0")),
    "rules that are ignored": of_manifest(
        lambda document: document.update(
            configuration={"select": [], "ignore": ["SIT1"], "reasons": {}, "severity": {}, "named": "x"}
        )
    ),
}
"""By what was changed, the file that is not as it was built any more, and the change."""


@pytest.mark.slow
def test_unchanged_package_passes_rebuild_verification(package, capsys):
    result = sitscad.verify(package, rebuild=True)
    assert result.ok and result.rebuilt == 0 and result.wrong_archive == 0
    with pytest.raises(SystemExit) as stop:
        main(["verify", str(package), "--rebuild"])
    assert stop.value.code == 0 and capsys.readouterr().out.endswith(", byte by byte what its spec makes\n")


@pytest.mark.parametrize("what", CHANGES)
def test_change_is_found_by_rebuild_despite_correct_hashes(package, what, monkeypatch):
    monkeypatch.setattr(verification, "_add_board_comparisons", lambda read, folder, manifest: read)  # bytes alone
    name, change = CHANGES[what]
    change(package)
    if name != MANIFEST:
        signed(package)
    message = sitscad.verify(package, rebuild=True).differences
    assert any(words.startswith((f"{name} ", f"{MANIFEST} ")) for words in message), message
    if what not in ("turns of the spec", "a comment of the spec"):  # these are what a build goes by
        ours = f"{name} is not made by spec/" if what == "a file of another" else f"{name} is "
        assert any(words.startswith(ours) for words in message), message


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("copper layers exchanged", "F_Cu.gbr says that it is Copper,L2,Bot, and single-coil-job.gbrjob that it"),
        ("coverlays exchanged", "F_Mask.gbr says that it is Soldermask,Bot"),
        ("a drill of 0.44 mm", "the hole at x 0.295 mm, y 0 mm is 440 um wide, where the netlist has 200 um"),
        ("a netlist's drill", "is 200 um wide, where the netlist has 300 um"),
        ("layers of the job exchanged", "lists single-coil-X_Cu.gbr, which is not there"),
        ("a layer taken out", "lists single-coil-B_Mask.gbr, which is not there"),
        ("layers of the order exchanged", "order.zip: single-coil.GTL is not as the file beside it"),
        ("a drill of the order", "order.zip: single-coil-PTH.drl is not as the file beside it"),
        ("a readme of the order", "order.zip: readme.txt is not as the file beside it"),
        ("a note in the order", "order.zip: note.txt is not as the file beside it"),
        ("an order without its netlist", "order.zip: single-coil-netlist.d356 is missing"),
        ("an order that is none", "order.zip: cannot be read"),
        ("tracks of 140 um", "order.zip: single-coil.GTL is not as the file beside it"),
    ],
)
def test_change_is_found_without_rebuild(package, what, said):
    _, change = CHANGES[what]
    change(package)
    signed(package)
    result = sitscad.verify(package)
    assert any(said in words for words in result.differences), result.differences
    assert not result.ok and result.rebuilt is None


def test_changed_spec_copy_is_found_by_manifest_hash(package):
    stored = (package / MANIFEST).read_text()
    CHANGES["turns of the spec"][1](package)
    text = re.sub(f'("{SPEC}": {{\n.*?"sha256": )"[0-9a-f]+"', rf'\1"{sha256((package / SPEC).read_bytes())}"', stored)
    assert text != stored
    (package / MANIFEST).write_text(text)
    (message,) = sitscad.verify(package).differences
    assert message == f"{SPEC} is not the spec that the manifest names (its SHA-256 differs)"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"sitscad": "0.0.9"}, "was built with sitscad 0.0.9"),
        ({"configuration": {"plugins": {"own.py": "0"}}}, "with the plugins {'own.py': '0'}"),
        ({"configuration": {"select": 3}}, "its configuration cannot be read"),
        ({"configuration": {"baseline": 3}}, "its configuration cannot be read"),
        ({"built": {"from": "", "for": ["soup"]}}, "no stage of sitscad's"),
    ],
)
def test_package_that_cannot_be_rebuilt_gives_exit_code_2(package, capsys, change, said):
    of_manifest(lambda document: document.update(change))[1](package)
    with pytest.raises(SystemExit) as stop:
        main(["verify", str(package), "--rebuild"])
    assert stop.value.code == 2 and said in capsys.readouterr().err


@pytest.mark.parametrize("text", ["sitscad: 2\n", "", "coil: [", "\xff"])
def test_invalid_spec_copy_gives_exit_code_2(package, capsys, text):
    (package / SPEC).write_bytes(text.encode("latin-1"))
    signed(package)
    with pytest.raises(SystemExit) as stop:
        main(["verify", str(package), "--rebuild"])
    assert stop.value.code == 2 and "builds nothing: SIT0" in capsys.readouterr().err


KNOWN = """\
sitscad: 1
name: kept
coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 100 um, trace_spacing: 90 um}
fpc: {rules: ourshop.yaml}
"""


@pytest.mark.slow
def test_rebuild_uses_stored_profile_configuration_and_baseline(tmp_path, monkeypatch, capsys):
    """A profile of one's own, a configuration, a waiver and a baseline: no package of those is said to be forged."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sitscad.toml").write_text(
        'profiles = "shops"\n[ignore]\nSIT116 = "agreed"\n[severity]\nSIT1 = "note"\nSIT102 = "error"\n'
    )
    (tmp_path / "shops").mkdir()
    (tmp_path / "shops/ourshop.yaml").write_text("based_on: generic-flex\n")
    (tmp_path / "odd: name?.yaml").write_bytes(b"\xef\xbb\xbf" + KNOWN.replace("\n", "\r\n").encode())
    for command, code in (
        (["check", "odd: name?.yaml", "--format", "json"], 1),
        (["build", "odd: name?.yaml", "--only", "gerber,firmware,report", "--baseline", "known.json"], 0),
        (["verify", "outputs/kept"], 0),
        (["verify", "outputs/kept", "--rebuild"], 0),
    ):
        with pytest.raises(SystemExit) as stop:
            main(command)
        text = capsys.readouterr()
        assert stop.value.code == code, (command, text)
        if command[0] == "check":
            (tmp_path / "known.json").write_text(text.out)


@pytest.mark.parametrize(
    "lost", [*(f"{ZIP}{end}" for end in (".GTL", ".GBS", "-PTH.drl", "-netlist.d356")), "readme.txt", ""]
)
def test_order_archive_with_plugins_lists_missing_files(package, lost):
    of_manifest(lambda document: document.update(configuration={"plugins": {"own.py": "0"}}))[1](package)
    (package / "fpc" / "own.csv").write_text("a file that a plugin writes and nobody sends\n")
    if lost:
        member(lambda files: without(files, lost))[1](package)
    signed(package)
    message = sitscad.verify(package).differences
    assert [words for words in message if "own.csv" in words] == []
    assert [words for words in message if "order.zip" in words] == [f"{STEM}order.zip: {lost} is missing"] * bool(lost)
