"""STEP files that a spec names: in its folder and below, of a size that a part has, and text as ISO 10303-21 has it.

What is in them is read by the parts' CAD kernel, in a process of its own (`sitscad.parts.imports.imported`).
"""

from __future__ import annotations

from pathlib import Path

from sitscad.spec.format.remarks import Remarks
from sitscad.spec.pieces.mounting import StepPart
from sitscad.spec.profiles.files import located, names_of
from sitscad.spec.profiles.origin import Origin

MOST_BYTES = 16 * 2**20
"""A STEP file at most: a package keeps it, and a jaw has some hundred kilobytes."""

BEGINS, ENDS = b"ISO-10303-21;", b"END-ISO-10303-21;"
Datum = str | tuple[float, ...] | None


def resolve_step(
    name: str, lies: tuple[Datum, str | None, str | None], key: str, place: Origin, remarks: Remarks
) -> StepPart | None:
    """The file named at a key (``mount.jaw.step``), with its datum and axes as written; None with its faults noted."""
    datum, along, up = lies[0] or (0.0, 0.0, 0.0), lies[1] or "x", lies[2] or "z"
    section = key.rpartition(".")[0]
    if along[-1] == up[-1]:
        message = f"{along} runs to the tail and {up} stands on the face: they are one line"
        remarks.flaw("SIT009", f"{section}.up", message, "two axes at right angles, like along: x, up: z")
    if isinstance(datum, str) and (lies[1] or lies[2]):
        message = f"the coordinate system {datum} says which way its axes run"
        remarks.flaw("SIT009", f"{section}.{'along' if lies[1] else 'up'}", message, "leave along and up out")
    path = located(name, place, key, remarks, "STEP", "jaw.step")
    content = None if path is None else _read(path, name, key, remarks)
    if path is None or content is None:
        return None
    remarks.files |= dict.fromkeys(names_of(name, path, place), content)
    return StepPart(_listed(name, path, place), _sha256(content), _point(datum), along, up)


def _read(path: Path, name: str, key: str, remarks: Remarks) -> bytes | None:
    """The bytes of a file that is one of STEP; None with what is wrong noted."""
    try:
        with path.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except OSError as error:
        remarks.flaw("SIT011", key, f"cannot read {name}: {error.strerror or error}", "is the path right?")
        return None
    if len(content) > MOST_BYTES:
        message = f"{name} is larger than {MOST_BYTES // 2**20} MiB"
        remarks.flaw("SIT010", key, message, "export the jaw alone, without the instrument's other parts")
        return None
    text = content.strip()
    if not text.startswith(BEGINS) or not text.endswith(ENDS) or b"\0" in content:
        message = f"{name} does not begin with {BEGINS.decode()} and end with {ENDS.decode()}"
        remarks.flaw("SIT011", key, message, "is it a STEP file (AP203, AP214 or AP242), and whole?")
        return None
    return content


def _listed(name: str, path: Path, place: Origin) -> str:
    """The name under which the file's bytes stand in the spec's source."""
    return sorted(names_of(name, path, place))[0]


def _point(datum: str | tuple[float, ...]) -> str | tuple[float, float, float]:
    return datum if isinstance(datum, str) else (datum[0], datum[1], datum[2])


def _sha256(content: bytes) -> str:
    import hashlib  # loads OpenSSL, which most uses of a spec do not need

    return hashlib.sha256(content).hexdigest()
