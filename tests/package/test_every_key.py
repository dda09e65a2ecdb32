"""Every key of the format at a value that is no default, through all commands; a key without a value fails here."""

from __future__ import annotations

import copy
import pickle
import shutil
from dataclasses import replace

import pytest
from spec_reference import SpecDocument, places_of

import sitscad
from sitscad.apps.watch.work import EarlierResults, stage_events
from sitscad.cli import run
from sitscad.package.cached_solutions import cached_solutions
from sitscad.package.manifest import hash_inputs
from sitscad.spec.format.kinds import Boolean, Choice, Either, Preset, ProfileName, Several, Sourced, names
from sitscad.spec.format.section import NameOr
from sitscad.spec.load import load_values, put_value
from sitscad.spec.yaml.source import SpecSource, read_yaml
from tests.conftest import EVERY_KEY

EVERY_TIME = ("jaw_from_a_file",)
"""The sample that CI takes through every command: the one with most kinds of files."""


@pytest.fixture(scope="module")
def folder_with_parts(every_key_folder):
    """The samples with STEP files of a jaw that stands on end, and of a block for a mount."""
    import build123d as bd

    jaw = bd.Solid.make_box(24, 8, 2.5).moved(bd.Location((-12, -4, -2.4)))
    for long, wide, floor in ((23, 6.8, 0), (6, 2, -9)):  # the pocket and the window that the sample writes
        corner = bd.Location((-long / 2, -wide / 2, floor))
        (jaw,) = (jaw - bd.Solid.make_box(long, wide, 10).moved(corner)).solids()
    turned = bd.Location((10, -1, 30)) * bd.Rotation(90, 0, 0) * bd.Rotation(0, 0, 180)
    bd.export_step(jaw.moved(turned), every_key_folder / "parts" / "jaw.step")
    bd.export_step(bd.Solid.make_box(3, 30, 30).moved(bd.Location((-2, -13, -12))), every_key_folder / "own.step")
    return every_key_folder


def keys_of_the_format():
    """Every key by its dotted path, with its declaration; keys by a pattern have the pattern as their last part."""
    for section, paths in places_of(SpecDocument).items():
        for path in paths:
            for name, key in section.keys.items():
                yield f"{path}.{name}".strip("."), key
            for like in section.alike.values():
                yield f"{path}.{like.pattern.pattern}".strip("."), None


def is_key(path, written):
    """Whether a key of the format is the one that is written, with the numbers of a list's entries in between."""
    bare = ".".join(part for part in written.split(".") if not part.isdecimal())
    section, _, name = path.rpartition(".")
    if "(" not in name:
        return path == bare
    pattern = next(like.pattern for each in places_of(SpecDocument) for like in each.alike.values())
    return bare.rpartition(".")[0] == section and pattern.fullmatch(bare.rpartition(".")[2]) is not None


def hash_of(spec):
    """The hash of a spec's values, without its text."""
    return hash_inputs(replace(spec, source=SpecSource("", "")))


def keys_with_a_value(path, without):
    """The keys of a list that a sample cannot be without: another sensor, or none, would come of it."""
    spec, text = sitscad.load(path), read_yaml(path.read_text("utf-8"))
    data, before = pickle.dumps(text.data), hash_of(spec)
    for written in text.keys:
        values = pickle.loads(data)
        if written.rpartition(".")[2].isdecimal() or not any(is_key(key, written) for key in without):
            continue
        put_value(values, written, None)
        try:
            after = hash_of(load_values(values, spec.source))
        except sitscad.SpecError:
            after = ""
        if after != before:
            yield written


@pytest.mark.slow
def test_every_spec_key_has_non_default_value_in_samples(every_key_folder):
    without = [path for path, _ in keys_of_the_format()]
    for name in EVERY_KEY:
        written = list(keys_with_a_value(every_key_folder / f"{name}.yaml", without))
        without = [path for path in without if not any(is_key(path, key) for key in written)]
    assert without == []


def through(capfd, path, *arguments):
    """Run one command in this process as a user does; it may find errors in the spec, and none in the program."""
    code = run([*arguments, str(path)])
    message = capfd.readouterr()
    assert code in (0, 1), (arguments, message.err)
    return code, message.out


@pytest.mark.slow
@pytest.mark.cad
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in EVERY_TIME else pytest.mark.more) for n in EVERY_KEY])
def test_sample_with_every_key_passes_every_command(name, folder_with_parts, tmp_path, monkeypatch, capfd):
    monkeypatch.setenv("SITSCAD_CACHE", str(tmp_path / "cache"))
    path, out = folder_with_parts / f"{name}.yaml", tmp_path / "out"
    spec = sitscad.load(path)
    with cached_solutions(spec.name):  # every command solves the same pads and coils
        through(capfd, path, "check", "-v", "--hints", "none")  # a build tries them
        through(capfd, path, "estimate")
        if spec.target is not None:
            cases = ("--case", "all") if spec.loads else ("--performance",)
            through(capfd, path, "response", *cases, *(("--cell", "2") if spec.cells else ()))
    assert through(capfd, path, "build", "--force", "-o", str(out))[0] == 0
    package = out / spec.name
    assert {file.parent.name for file in package.rglob("*.stl")} >= {"mount"}
    assert through(capfd, package, "verify")[0] == 0
    light = ("--only", "gerber,kicad,laser,firmware,datasheet,calibration,report")
    assert through(capfd, path, "build", "--force", *light, "-o", str(tmp_path / "light"))[0] == 0
    with cached_solutions(spec.name):
        assert through(capfd, tmp_path / "light" / spec.name, "verify", "--rebuild")[0] == 0


@pytest.mark.slow
@pytest.mark.cad
def test_changed_step_file_updates_watched_solid(folder_with_parts, tmp_path):
    import build123d as bd

    path = shutil.copytree(folder_with_parts, tmp_path / "specs") / "own_mount.yaml"
    before, sizes = EarlierResults(), []
    for side in (3, 4):
        bd.export_step(bd.Solid.make_box(3, 10 * side, 30).moved(bd.Location((-2, -13, -12))), path.parent / "own.step")
        events = {event.stage: event for event in stage_events(str(path), before, serves=True)}
        assert str(path.parent / "own.step") in events["findings"].data["read"]
        sizes.append(before.files["solids"][1])
    assert sizes[0] != sizes[1]


def words_of(kind):
    """The words that a kind of value may be, presets' names among them."""
    if isinstance(kind, Choice):
        return kind.allowed
    if isinstance(kind, Preset):
        return names(kind.kind)
    if isinstance(kind, ProfileName):
        return words_of(Preset("rules"))
    if isinstance(kind, NameOr):
        return words_of(kind.preset)
    if isinstance(kind, Either):
        return (kind.word, *words_of(kind.other))
    if isinstance(kind, Boolean):
        return (True, False)
    if isinstance(kind, (Several, Sourced)):
        return words_of(kind.one if isinstance(kind, Several) else kind.figure)
    return ()


PLAIN = """\
sitscad: 1
name: plain
coil: {shape: circle, outer_diameter: 8, turns: 3, layers: 2, trace_width: 0.16, trace_spacing: 0.16}
fpc: {tail: {length: 30}, rules: {based_on: generic-fine}}
target: {}
elastomer: {}
encapsulation: {}
mount: {standoff: 2}
shield: {}
readout: {}
requirements: {normal_force: 3 N}
"""

STEP = {"mount.kind": "custom", "mount.step": "own.step"}
JAW = {"mount.jaw.based_on": "generic-10mm"}
JAW_STEP = {**JAW, "mount.jaw.step": "own.step"}
LAYERS = [{"coverlay": 0.03}, {"copper": 0.03}, {"dielectric": 0.03}, {"copper": 0.03}, {"coverlay": 0.03}]
OWN = {f"array.reference.coil.{key}": value for key, value in {
    "shape": "circle", "outer_diameter": 8, "turns": 3, "layers": 2, "trace_width": 0.16, "trace_spacing": 0.16,
}.items()}
SQUARE = {"array.reference.coil.shape": "square"}

BESIDE = {
    "coil.shape": [{}, {"coil.outer_diameter": [9, 7]}],
    "coil.sense": [{}],
    "coil.start": [{"coil.shape": "square"}],
    "array.reference.coil.shape": [OWN, {**OWN, "array.reference.coil.outer_diameter": [9, 7]}],
    "array.reference.coil.sense": [OWN],
    "array.reference.coil.start": [{**OWN, **SQUARE}],
    "array.pattern": [{}, {"array.centres": [[-5, 0], [5, 0]]}],
    "fpc.rules": [{}],
    "fpc.stackup.0.material": [{"fpc.stackup": LAYERS}],
    "fpc.body.shape": [{"fpc.body.size": 20}, {"fpc.body.file": "body.dxf"}],
    "fpc.largest.shape": [{"fpc.largest.size": 20}, {"fpc.largest.file": "body.dxf"}],
    "fpc.tail.connector": [{}],
    "target.shape": [{}, {"target.size": [8, 6]}],
    "elastomer.shape": [{}, {"elastomer.size": [9, 7]}],
    "mount.kind": [{}],
    "mount.jaw.based_on": [{}],
    "mount.jaw.material": [JAW],
    "mount.jaw.along": [JAW_STEP, {**JAW_STEP, "mount.jaw.up": "y"}],
    "mount.jaw.up": [JAW_STEP, {**JAW_STEP, "mount.jaw.along": "y"}],
    "mount.along": [STEP, {**STEP, "mount.up": "y"}],
    "mount.up": [STEP, {**STEP, "mount.along": "y"}],
    "mount.retention.kind": [{}],
    "mount.holes": [{"mount.kind": "bench-plate"}],
    "mount.metal_behind.material": [
        {"mount.kind": "custom", "mount.metal_behind.distance": 2, "mount.metal_behind.thickness": 1},
    ],
    "mount.finger.shape": [{"mount.kind": "fingertip", "mount.finger.size": 15}],
    "mount.finger.material": [{"mount.kind": "fingertip"}],
    "loads.scissor.face": [{"loads.scissor.opening": "2 deg"}],
}
"""What else has to stand in the spec where a key has some of its words; one of these serves."""


def all_words():
    """Every key that takes words, with each of them."""
    for path, key in keys_of_the_format():
        path = path.replace("fpc.stackup.", "fpc.stackup.0.")
        if key is not None and "tracks." not in path:
            yield from ((path, word) for word in words_of(key.kind))


def with_more(every_key_folder, values, taken, path, word):
    """The values with a word at a key, and the keys that it takes; None where no spec comes of it."""
    for beside in BESIDE.get(path, [{}]):
        added = {**beside, path: word}
        if any(taken.get(key, value) != value for key, value in added.items()):
            continue
        result = copy.deepcopy(values)
        try:
            for key, value in added.items():
                put_value(result, key, value)
            load_values(result, SpecSource(str(every_key_folder / "plain.yaml"), PLAIN))
        except (sitscad.SpecError, ValueError):
            continue
        return result, taken | added
    return None


@pytest.mark.slow
def test_every_allowed_value_of_every_key_is_checked(every_key_folder):
    left = list(all_words())
    assert len(left) > 200
    while left:
        values, taken, rest = read_yaml(PLAIN).data, {}, []
        for path, word in left:
            more = None if path in taken else with_more(every_key_folder, values, taken, path, word)
            if more is None:
                rest.append((path, word))
            else:
                values, taken = more
        assert len(rest) < len(left), f"no spec takes {rest}"
        left = rest
        spec = load_values(values, SpecSource(str(every_key_folder / "plain.yaml"), PLAIN))
        layout = sitscad.lay_out(spec)
        sitscad.check(spec, layout, hints="none")
