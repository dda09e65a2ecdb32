"""A package built again from the spec that it keeps, in memory: what a build makes of that, byte by byte.

Of the package itself only ``spec/`` is believed, and of its manifest what was asked for: the stages, the policy and
baseline that findings were held against, and the plugins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sitscad.package import stages
from sitscad.package.building import Asked
from sitscad.package.folder import FILE_NAME, PackageError, list_files
from sitscad.package.manifest import MANIFEST, Manifest
from sitscad.package.stages import SPEC_FOLDER, UNNAMED, Made
from sitscad.package.values import CHECK_STAGE
from sitscad.policy import Policy, kept_baseline, kept_policy
from sitscad.spec.load import load
from sitscad.spec.rules import SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.version import __version__
from sitscad.writer import STAGES, marks


def spec_path(folder: Path, manifest: Manifest) -> Path:
    """Where a package keeps its spec."""
    own = manifest.spec["file"]
    return folder / SPEC_FOLDER / (own if FILE_NAME.fullmatch(own) else UNNAMED)


def rebuilt(folder: Path, manifest: Manifest) -> tuple[Made, Manifest]:
    """All files of a package as its spec makes them, and their manifest.

    Raises
    ------
    PackageError
        where it cannot be built again: of another version, with other plugins, from a spec that is none.
    MissingExtra
        when a stage needs a package that is not installed.
    """
    asked = _asked(folder, manifest)
    contents = stages.contents_of(asked.spec, asked.policy, asked.baseline)
    made = stages.make_all(contents, folder, Manifest(), asked.wanted, lambda *_: None, force=True)
    key = manifest.built_from if manifest.built_from in _keys(asked) else asked.made_from(Manifest())
    document = stages.manifest_of(made.contents, made, manifest, key, asked.wanted)
    return made, replace(document, built_for=manifest.built_for)


def rebuilt_differences(folder: Path, manifest: Manifest) -> Iterator[str]:
    """What of a package is not, byte by byte, what its spec makes, in words."""
    made, document = rebuilt(folder, manifest)
    stale = {entry.stage for name, entry in manifest.files.items() if made.entries.get(name, entry) != entry}
    other = {s for s in stale if {e.made_from for e in manifest.of_stage(s).values()} != _made_from(made, s)}
    for name, content in sorted(made.files.items()):
        path = folder / name
        if path.is_symlink() or not path.is_file():
            yield f"{name} is missing: {SPEC_FOLDER}/ makes it"
        elif path.read_bytes() != content:
            yield f"{name} is not what {SPEC_FOLDER}/ makes"
    there = set(list_files(folder)) & set(manifest.files)
    yield from (f"{name} is not made by {SPEC_FOLDER}/" for name in sorted(there - set(made.files)))
    if (folder / MANIFEST).read_bytes() != document.as_bytes():
        yield f"{MANIFEST} is not the one of such a build" + (
            f": {', '.join(sorted(other))} of another spec, code, CAD kernel or SOURCE_DATE_EPOCH" if other else ""
        )


def _made_from(made: Made, stage: str) -> set[str]:
    return {entry.made_from for entry in made.entries.values() if entry.stage == stage}


def _keys(asked: Asked) -> set[str]:
    """What a whole package can say that it was built from: it counts CAD kernels where the one before had solids."""
    return {replace(asked, wanted=wanted).made_from(Manifest()) for wanted in (asked.wanted, frozenset(STAGES))}


def _asked(folder: Path, manifest: Manifest) -> Asked:
    """What a package was built of and for, as far as its manifest says so."""
    if manifest.version != __version__:
        raise PackageError(
            f"{folder} was built with sitscad {manifest.version}, and this is {__version__}: only that version builds "
            "it again"
        )
    said: Mapping[str, Any] = manifest.configuration
    if said.get("plugins", {}) != dict(marks()):
        raise PackageError(
            f"{folder} was built with the plugins {said.get('plugins') or 'none'}, and those in force are "
            f"{dict(marks()) or 'none'}: name the files that it was built with as --plugin"
        )
    wanted = {*manifest.built_for, *(entry.stage for entry in manifest.files.values())}
    if unknown := sorted(wanted - {*STAGES, CHECK_STAGE}):
        raise PackageError(f"{folder} was built for {', '.join(unknown)}: no stage of sitscad's")
    spec = _kept_spec(folder, manifest)
    try:
        policy = kept_policy(said) if "select" in said else Policy()
        kept = said.get("baseline")
        baseline = None if kept is None else kept_baseline(spec.source.path, spec.name, kept)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise PackageError(f"{folder / MANIFEST}: its configuration cannot be read ({error})") from error
    return Asked(spec, folder, frozenset(wanted), True, policy, baseline)


def _kept_spec(folder: Path, manifest: Manifest) -> SensorSpec:
    """The spec in a package under the name that it was read by: reports call it so."""
    path, own = spec_path(folder, manifest), manifest.spec["file"]
    try:
        spec = load(path)
    except SpecError as error:
        (first, *_) = error.findings
        raise PackageError(f"{path} builds nothing: {first.rule} {first.message}") from error
    files = {own if name == path.name else name: content for name, content in spec.source.files.items()}
    return spec.known(replace(spec.source, path=own, files=files))
