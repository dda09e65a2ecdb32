"""A panel's frame and cuts held against its list of places: tooling holes, fiducials, and a cut round every copy that
stops at the bridges and nowhere else.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from sitscad.extraction.panel_list import PanelList, Place
from sitscad.extraction.plotted import REGION, Plotted

FLASH = 0
"""Mode of an object that is flashed or drilled."""

Box = tuple[int, int, int, int]


def frame_differences(
    rest: Plotted, function: str, name: str, listed: PanelList, apertures: Sequence[str]
) -> Iterator[str]:
    """What a file shows on the frame and should not, or should and does not.

    ``rest`` are the objects that belong to no copy. Tooling holes stand in the file of holes that are not plated,
    fiducials on the outer copper and in the openings over it; any other line or flash must lie on the rails.
    """
    marks = _marks_wanted(function, listed)
    flashes = rest.objects[(rest.objects[:, 2] == FLASH) & (rest.objects[:, 0] != REGION)]
    there = Counter((_diameter(row[0], name, apertures), row[5], row[6]) for row in flashes.tolist())
    for (size, x, y), count in (marks - there).items():
        what = "tooling hole" if name.endswith(".drl") else "fiducial"
        yield f"{name} has no {what} of {size / 1e6:.4g} mm at {shown_place((x, y))} of the panel ({count} missing)"
    yield from _off_rails(rest, there - marks, name, listed, apertures)


def _marks_wanted(function: str, listed: PanelList) -> Counter[tuple[int, int, int]]:
    """Size and place of all marks that a file shows on the frame."""
    kind, *fields = function.split(",")
    if kind == "NonPlated":
        return Counter((listed.tooling_hole, *at) for at in listed.tooling_holes)
    if {"Top", "Bot"} & set(fields) and kind in ("Copper", "Soldermask"):
        size = listed.fiducial if kind == "Copper" else listed.fiducial_opening
        return Counter((size, *at) for at in listed.fiducials)
    return Counter()


def _off_rails(
    rest: Plotted, unknown: Counter[tuple[int, int, int]], name: str, listed: PanelList, apertures: Sequence[str]
) -> Iterator[str]:
    """Marks that are not listed, and what else is not just a line on the rails."""
    if unknown:
        _, *at = min(unknown)
        yield f"{name} has {unknown.total()} marks that are not listed, the first at {shown_place(at)} of the panel"
    lines = rest.objects[(rest.objects[:, 2] != FLASH) | (rest.objects[:, 0] == REGION)]
    x0, y0, x1, y1 = Plotted(lines).boxes().T
    half = np.array([mark_reach(tool, name, apertures) for tool in lines[:, 0].tolist()], dtype=np.int64)
    inner = inside_rails(listed)
    wrong = (x1 + half > inner[0]) & (x0 - half < inner[2]) & (y1 + half > inner[1]) & (y0 - half < inner[3])
    wrong |= ((lines[:, 0] == REGION) & (lines[:, 2] > 0)) | (lines[:, 1] > 0)
    if wrong.any():
        at = lines[wrong][0].tolist()[5:7]
        yield f"{name} has {wrong.sum()} objects that belong to no board, the first at {shown_place(at)} of the panel"


def inside_rails(listed: PanelList) -> Box:
    """What the rails enclose: the tooling holes stand in their middles."""
    rail = 2 * min(x for x, _ in listed.tooling_holes) if listed.tooling_holes else 0
    return rail, rail, listed.size[0] - rail, listed.size[1] - rail


def cut_differences(cuts: Plotted, bridges: Sequence[tuple[Place, Place]], where: str) -> Iterator[str]:
    """Whether the cut round one copy, moved to its origin, stops at the bridges and nowhere else."""
    if not len(cuts.objects):
        yield f"{where} is not cut out"
        return
    ends = Counter[Place]()
    for _, _, _, x0, y0, x, y, _, _ in cuts.objects.tolist():
        ends.update({(x0, y0), (x, y)} if (x0, y0) != (x, y) else ())
    opened = {at for at, count in ends.items() if count % 2}
    for begin, end in bridges:
        if not {begin, end} <= opened:
            middle = ((begin[0] + end[0]) // 2, (begin[1] + end[1]) // 2)
            yield f"{where}: the cut does not stop at both ends of the bridge at {shown_place(middle)} of the board"
    if others := opened - {at for bridge in bridges for at in bridge}:
        yield f"{where}: the cut stops where no bridge is, first at {shown_place(min(others))} of the board"


def _diameter(tool: int, name: str, apertures: Sequence[str]) -> int:
    """The diameter (nm) of a hole or of a round aperture; 0 for any other shape."""
    if name.endswith(".drl"):
        return tool
    found = re.fullmatch(r"C,([\d.]+)", apertures[tool])
    return round(float(found[1]) * 1e6) if found else 0


def mark_reach(tool: int, name: str, apertures: Sequence[str]) -> int:
    """Half the width (nm) of an aperture or a hole, or more."""
    if name.endswith(".drl"):
        return tool // 2
    if tool == REGION:
        return 0
    return round(sum(float(size) for size in re.findall(r"[\d.]+", apertures[tool])) * 1e6)


def shown_place(at: Sequence[int]) -> str:
    """A place (nm) in words."""
    return f"x {at[0] / 1e6:.4g} mm, y {at[1] / 1e6:.4g} mm"
