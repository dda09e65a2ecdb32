"""The spec in its package: byte by byte as it was read, with the profiles that it names, so that it builds again."""

from __future__ import annotations

import json

import pytest
from tolerance import approx

import sitscad
from sitscad.package.folder import list_files

SPEC = """\
sitscad: 1
name: kept
coil: {shape: circle, outer_diameter: 10, turns: 12.5, layers: 2, trace_width: 150 um, trace_spacing: 150 um}
"""
OWN = b"\xef\xbb\xbfbased_on: ../base.yaml\r\nname: our shop\r\ntrace_width: 90 um\r\n"
BASE = b"based_on: generic-flex\nname: base # of ours\ntrace_spacing: 95 um\n"
LIGHT = ("gerber", "kicad", "firmware", "report")


def _contents(folder):
    return {name: (folder / name).read_bytes() for name in list_files(folder)}


def _written(folder, name, content):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def test_package_contains_bytes_of_spec(tmp_path):
    content = b"\xef\xbb\xbf" + SPEC.replace("\n", "\r\n").encode()
    path = _written(tmp_path, "mine.yaml", content)
    built = sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",))
    assert (built.directory / "spec" / "mine.yaml").read_bytes() == content
    manifest = json.loads((built.directory / "manifest.json").read_text())
    assert manifest["files"]["spec/mine.yaml"]["stage"] == "check"


@pytest.mark.slow
def test_package_rebuilds_from_stored_spec_and_profiles(tmp_path):
    path = _written(tmp_path, "mine.yaml", (SPEC + "fpc: {rules: shops/our shop.yaml}\n").encode())
    _written(tmp_path, "shops/our shop.yaml", OWN)
    _written(tmp_path, "base.yaml", BASE)
    _written(tmp_path, "shops/another.yaml", BASE)
    first = sitscad.build(sitscad.load(path), tmp_path / "one", LIGHT).directory
    stored = {name: content for name, content in _contents(first).items() if name.startswith("spec/")}
    assert stored == {"spec/mine.yaml": path.read_bytes(), "spec/shops/our shop.yaml": OWN, "spec/base.yaml": BASE}
    again = sitscad.build(sitscad.load(first / "spec" / "mine.yaml"), tmp_path / "two", LIGHT).directory
    assert _contents(again) == _contents(first)


def test_linked_profile_is_stored_under_both_paths(tmp_path):
    path = _written(tmp_path, "mine.yaml", (SPEC + "fpc: {rules: shops/ours.yaml}\n").encode())
    _written(tmp_path, "all/real.yaml", b"based_on: ../base.yaml\n")
    _written(tmp_path, "base.yaml", BASE)
    (tmp_path / "shops").mkdir()
    (tmp_path / "shops" / "ours.yaml").symlink_to("../all/real.yaml")
    built = sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",)).directory
    assert {"spec/shops/ours.yaml", "spec/all/real.yaml", "spec/base.yaml"} <= set(list_files(built))
    again = sitscad.load(built / "spec" / "mine.yaml")
    assert again.fpc.rules.trace_spacing == approx(95e-6, rel=1e-6)


def test_changed_profile_comment_changes_package(tmp_path):
    path = _written(tmp_path, "mine.yaml", (SPEC + "fpc: {rules: base.yaml}\n").encode())
    _written(tmp_path, "base.yaml", BASE)
    sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",))
    _written(tmp_path, "base.yaml", BASE + b"# read again\n")
    built = sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",))
    assert {stage.name: stage.outcome for stage in built.stages}["check"] == "made"
    assert (built.directory / "spec" / "base.yaml").read_bytes() == BASE + b"# read again\n"


def test_spec_without_valid_file_name_is_stored_under_safe_name(tmp_path):
    spec = sitscad.load_text(SPEC)
    built = sitscad.build(spec, tmp_path / "one", ("firmware",)).directory
    assert [n for n in list_files(built) if n.startswith("spec/")] == ["spec/spec.yaml"]
    odd = sitscad.load(_written(tmp_path, ".my:spec?.yaml", SPEC.encode()))
    built = sitscad.build(odd, tmp_path / "two", ("firmware",)).directory
    assert [n for n in list_files(built) if n.startswith("spec/")] == ["spec/spec.yaml"]
    assert (built / "spec" / "spec.yaml").read_bytes() == SPEC.encode()


@pytest.mark.slow
def test_changed_step_file_rebuilds_package(tmp_path):
    path = _written(tmp_path, "mine.yaml", (SPEC + "mount: {kind: custom, step: parts/own.step}\n").encode())
    item, other = (b"ISO-10303-21;\n%s\nEND-ISO-10303-21;\n" % inside for inside in (b"DATA;", b"DATA; "))
    _written(tmp_path, "parts/own.step", item)
    built = sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",))
    assert (built.directory / "spec" / "parts" / "own.step").read_bytes() == item
    assert sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",)).is_unchanged
    assert sitscad.verify(built.directory, rebuild=True).ok
    _written(tmp_path, "parts/own.step", other)
    again = sitscad.build(sitscad.load(path), tmp_path / "out", ("firmware",))
    assert not again.is_unchanged
    assert (built.directory / "spec" / "parts" / "own.step").read_bytes() == other
