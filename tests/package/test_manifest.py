"""The manifest: what it refuses, what it hashes, and what it makes of files that are not its own."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from types import MappingProxyType

import pytest

from sitscad.package.folder import PackageError
from sitscad.package.manifest import (
    MANIFEST,
    Entry,
    Manifest,
    foreign_files,
    hash_inputs,
    read_intact_files,
    read_manifest,
    sha256,
)


@dataclasses.dataclass(frozen=True)
class One:
    a: float
    b: Mapping[str, float]


@dataclasses.dataclass(frozen=True)
class Other:
    a: float
    b: Mapping[str, float]


ENTRY = {"sha256": "0", "stage": "gerber", "made_from": "0"}
WHOLE = {
    "sitscad": "0.1.0", "spec": {"name": "x", "file": "x.yaml", "sha256": "0"}, "forced": False, "nets": {},
    "configuration": {}, "built": {}, "files": {},
}


def test_base_of_hostile_manifests_is_valid(tmp_path):
    (tmp_path / MANIFEST).write_text(json.dumps({**WHOLE, "files": {"a": ENTRY}}))
    assert read_manifest(tmp_path).files["a"].stage == "gerber"


def _package(tmp_path, **files: bytes):
    entries = {}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        entries[name] = Entry(sha256(content), "gerber", "0")
    manifest = Manifest(
        spec={"name": "x", "file": "x.yaml", "sha256": "0"}, nets={"C1": ("C1.A", "C1.B")}, files=entries
    )
    (tmp_path / MANIFEST).write_bytes(manifest.as_bytes())
    return manifest


def test_manifest_round_trip_preserves_content(tmp_path):
    manifest = _package(tmp_path, one=b"1", two=b"2")
    assert read_manifest(tmp_path) == manifest
    document = json.loads((tmp_path / MANIFEST).read_bytes())
    assert document["files"]["one"] == {"sha256": sha256(b"1"), "stage": "gerber", "made_from": "0"}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "null",
        "{}",
        '{"sitscad": "1", "spec": {}}',
        '{"sitscad": "1", "spec": {}, "files": []}',
        '{"sitscad": "1", "spec": {}, "files": {"a": 1}}',
        '{"sitscad": "1", "spec": {}, "files": {"a": {"sha256": "0"}}}',
        '{"sitscad": "1", "spec": {}, "files": {"../a": {"sha256": "0", "stage": "x", "made_from": "0"}}}',
        '{"sitscad": "1", "spec": {}, "files": {"/etc/passwd": {"sha256": "0", "stage": "x", "made_from": "0"}}}',
        "[" * 100_000,
        "\xff",
        "1" * 5000,
        *(
            json.dumps({**WHOLE, key: value})
            for key, value in [
                *((key, value) for key in WHOLE for value in (3, "x", None, [3], {"a": 3}, {"a": [3]})),
                ("files", {"a": {**ENTRY, "more": "1"}}),
                ("files", {"a": {**ENTRY, "stage": 7}}),
                ("spec", {"name": "x", "file": 3, "sha256": "0"}),
                ("built", {"from": [], "for": []}),
                ("built", {"from": "", "for": {"a": 1}}),
            ]
            if type(value) is not type(WHOLE[key]) or (value and key in ("files", "nets", "spec"))
        ),
    ],
)
def test_invalid_manifest_gives_plain_package_error(tmp_path, text):
    (tmp_path / MANIFEST).write_bytes(text.encode("latin-1"))
    with pytest.raises(PackageError) as message:
        read_manifest(tmp_path)
    for words in ("object", "attribute", "argument", "iterable", "subscript", "indices", "unpack", "NoneType", "__"):
        assert words not in str(message.value), message.value


def test_changed_added_linked_and_missing_files_are_distinguished(tmp_path):
    manifest = _package(tmp_path, same=b"1", changed=b"2", missing=b"3", linked=b"4")
    (tmp_path / "changed").write_bytes(b"!")
    (tmp_path / "missing").unlink()
    (tmp_path / "linked").rename(tmp_path / "elsewhere")
    (tmp_path / "linked").symlink_to("elsewhere")
    (tmp_path / "board.kicad_prl").write_bytes(b"of no project in this package")
    assert foreign_files(tmp_path, manifest) == ["board.kicad_prl", "changed", "elsewhere", "linked"]
    assert read_intact_files(tmp_path, {"same": manifest.files["same"]}) == {"same": b"1"}
    for name in ("changed", "missing", "linked"):
        assert read_intact_files(tmp_path, {name: manifest.files[name]}) is None


def test_hash_depends_on_values_and_types_but_not_order(monkeypatch):
    assert hash_inputs(One(1.0, {"x": 1.0, "y": 2.0})) == hash_inputs(One(1.0, MappingProxyType({"y": 2.0, "x": 1.0})))
    different = [
        One(1.0, {}),
        Other(1.0, {}),
        One(1.0 + 2**-52, {}),
        One(1.0, {"x": 0.0}),
        (1.0, {}),
        "1.0",
    ]
    assert len({hash_inputs(value) for value in different}) == len(different)
    before = hash_inputs(1.0)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    assert hash_inputs(1.0) != before


def test_value_without_fixed_text_gives_type_error():
    with pytest.raises(TypeError):
        hash_inputs({1, 2})
    with pytest.raises(TypeError):
        hash_inputs(object())
