"""STEP files (AP214) of mount and jaw, and of the whole assembly with names and colours, as repeatable bytes.

OpenCASCADE writes four things that change from run to run:

* the time in the header,
* a process-wide counter in ``NEXT_ASSEMBLY_USAGE_OCCURRENCE``,
* the order of the colours (a hash of addresses),
* line breaks, whose places depend on counter and numbers.

Shapes and names are taken from OpenCASCADE (parts through build123d, the assembly through cadquery). Header, counter
and colours are written here. Every entity is on one line, and zeros are written as ``0.``.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime
from itertools import count
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.solids.solid import Solid, import_extra, select_by_role
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import creation_second

_HEADER = re.compile(r"FILE_NAME\(.*?\);", re.DOTALL)
_USAGE = re.compile(r"(?<=NEXT_ASSEMBLY_USAGE_OCCURRENCE\(')\d+")
_BREP = re.compile(r"ADVANCED_BREP_SHAPE_REPRESENTATION\('[^']*',\(([#\d,\s]*)\),\s*(#\d+)\)")
_SOLID = re.compile(r"(#\d+) = MANIFOLD_SOLID_BREP\(")
_ENTITY = re.compile(r"^#(\d+) = ", re.MULTILINE)
_BREAK = re.compile(r"(?<!;)\n *")  # A line break inside an entity, also within a name
_ZERO = re.compile(r"(?<=[(,])-?(?:0\.|\d\.\d*E-(?:1[4-9]|[2-9]\d))(?=[,)])")
"""Numbers (millimetres, direction components) that are zero except for rounding or sign."""


def render(solids: tuple[Solid, ...], spec: SensorSpec, aids: tuple[Solid, ...] = ()) -> dict[str, bytes]:
    """Return ``mount/NAME-<solid>.step`` of each part of mount, jaw, jig and mould. Empty if there is no mount."""
    if spec.mount is None:
        return {}
    pieces = (*select_by_role(solids, BodyRole.MOUNT, BodyRole.JAW), *aids)
    return {f"mount/{spec.name}-{piece.name}.step": part(piece, f"{spec.name}-{piece.name}") for piece in pieces}


def render_whole(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """Return ``mount/assembly.step`` with every part in place, as assembled."""
    return {"mount/assembly.step": assembly(solids, f"{spec.name}-assembly")}


def part(solid: Solid, title: str) -> bytes:
    """Return a STEP file of one solid in the assembly's coordinates (mm), written by build123d."""
    bd = import_extra("build123d")
    shape = bd.Solid(solid.shape.wrapped, label=title)
    with TemporaryDirectory() as folder:
        path = FilePath(folder) / "part.step"
        bd.export_step(shape, path, timestamp=_timestamp())
        return _finished(path.read_text(encoding="ascii"), title, (solid,))


def assembly(solids: tuple[Solid, ...], title: str) -> bytes:
    """Return a STEP assembly of all solids in place (mm), with names and colours, written by cadquery.

    `title` must differ from the names of the solids.
    """
    cq = import_extra("cadquery")
    whole = cq.Assembly(name=title)
    for solid in solids:
        whole.add(cq.Shape.cast(solid.shape.wrapped), name=solid.name)
    with TemporaryDirectory() as folder:
        path = FilePath(folder) / "assembly.step"
        cq.exporters.assembly.exportAssembly(whole, str(path))
        return _finished(path.read_text(encoding="ascii"), title, solids)


def _timestamp() -> str:
    """Return the time for the header: ``SOURCE_DATE_EPOCH`` if set, otherwise the first second of 1970."""
    return datetime.fromtimestamp(creation_second() or 0, UTC).strftime("%Y-%m-%dT%H:%M:%S")


def _finished(text: str, title: str, solids: tuple[Solid, ...]) -> bytes:
    """Return the file with sitscad's header and colours, and with occurrences numbered from 1."""
    name = f"FILE_NAME('{title}','{_timestamp()}',(''),(''),'Open CASCADE Technology','sitscad','');"
    numbers = count(1)
    text = _BREAK.sub("", _HEADER.sub(lambda _: name, text, count=1))
    text = _ZERO.sub("0.", _USAGE.sub(lambda _: str(next(numbers)), text))
    body, end, tail = text.rpartition("ENDSEC;")
    # Entities for the colour of every solid, in the order of the solids (styled items of ISO 10303-46)
    contexts = {item: match[2] for match in _BREP.finditer(body) for item in re.findall(r"#\d+", match[1])}
    breps = _SOLID.findall(body)
    if len(breps) != len(solids):
        raise ValueError(f"the STEP file holds {len(breps)} solids, {len(solids)} were written")
    free = max(int(number) for number in _ENTITY.findall(body)) + 1
    lines = []
    for n, (brep, solid) in zip(count(free, 9), zip(breps, solids, strict=True), strict=False):
        colour = ",".join(f"{value:.6f}" for value in solid.rgb)
        lines += [
            f"#{n} = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#{n + 1}),{contexts[brep]});",
            f"#{n + 1} = STYLED_ITEM('color',(#{n + 2}),{brep});",
            f"#{n + 2} = PRESENTATION_STYLE_ASSIGNMENT((#{n + 3}));",
            f"#{n + 3} = SURFACE_STYLE_USAGE(.BOTH.,#{n + 4});", f"#{n + 4} = SURFACE_SIDE_STYLE('',(#{n + 5}));",
            f"#{n + 5} = SURFACE_STYLE_FILL_AREA(#{n + 6});", f"#{n + 6} = FILL_AREA_STYLE('',(#{n + 7}));",
            f"#{n + 7} = FILL_AREA_STYLE_COLOUR('',#{n + 8});", f"#{n + 8} = COLOUR_RGB('',{colour});",
        ]
    return (body + ("\n".join(lines) + "\n") + end + tail).encode("ascii")
