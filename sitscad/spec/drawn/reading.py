"""Read a coil that a spec names as drawn: the file, its conductor, and the spiral that it winds."""

from __future__ import annotations

from dataclasses import replace

from sitscad.spec.coil import CoilSpec
from sitscad.spec.drawn.copper import DrawnCoilError, DrawnCopper
from sitscad.spec.drawn.follow import conductor_of
from sitscad.spec.drawn.kicad import kicad_copper
from sitscad.spec.drawn.spiral import recognised
from sitscad.spec.profiles import Origin
from sitscad.spec.reading import Remarks

KEY = "coil.drawn"

MOST_BYTES = 32 * 2**20
"""Largest size of a file (bytes). A package holds a copy of the file."""


def coil_from_file(written: CoilSpec, place: Origin, copper_layers: int | None, remarks: Remarks) -> CoilSpec:
    """Return the coil that is drawn in a file.

    If the file cannot be used, record the reason as an error in `remarks` and return a small circle in its place. The
    file's bytes are added to `remarks.files`. `copper_layers` is the number of copper layers of the written stack-up;
    None if the spec has none.
    """
    assert written.drawn is not None
    # a small coil in place of a file that cannot be used, for the checks of the rest of the spec
    unread = replace(written, shape="circle", size=(1e-3, 1e-3), turns=1.0, trace_width=1e-4, trace_spacing=1e-4)
    smaller = "name the coil's own board"
    file = place.content(written.drawn, KEY, remarks, "KiCad", "coil.kicad_mod", MOST_BYTES, smaller)
    if file is None:
        return unread
    content, names = file
    remarks.files |= dict.fromkeys(names, content)
    written = replace(written, drawn=min(names))
    try:
        copper = kicad_copper(content, "the file")
        conductor = conductor_of(copper, written.net or "", written.start_pad or "", written.end_pad or "")
        return recognised(conductor, _layers(copper, copper_layers), written, copper.heights)
    except DrawnCoilError as error:
        remarks.flaw("SIT011", KEY, f"{written.drawn}: {error}", "correct the drawing, or write the coil's shape")
        return unread


def _layers(copper: DrawnCopper, count: int | None) -> tuple[str, ...]:
    """Return the names of the file's copper layers from the top, for a stack-up with `count` copper layers.

    None stands for the default stack-up, which has two. Raises DrawnCoilError if the file has another number.
    """
    names = copper.names_for(2 if count is None else count)
    if not names:
        layers = "the default stack-up has 2" if count is None else f"fpc.stackup has {count}"
        raise DrawnCoilError(f"it has {len(copper.layers)} copper layers, {layers}: write its own stack-up")
    return names
