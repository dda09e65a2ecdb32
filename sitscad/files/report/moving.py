"""Data and pages for the scripts: the assembly in 3-D, the pushed sensor, and live readings of a board."""

from __future__ import annotations

import base64
import json
import math
import struct
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.assembly.places.bodies import plates_of
from sitscad.calibration.inverse_map import BEYOND, LEAST
from sitscad.calibration.unknowns import usual_value
from sitscad.estimates import Estimates
from sitscad.estimates.circuits.settings import STATUS, board_identity, devices, frequency_bands, serial_settings
from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate
from sitscad.estimates.performance_values import AXIS_WORDS, MOMENTS
from sitscad.files.drawing.frame import FORCED
from sitscad.files.drawing.pictures.layout_picture import coil_extent
from sitscad.files.drawing.web_page import html_page, html_section
from sitscad.kernels.converters.conversion import Conversion
from sitscad.kernels.geometry.path import Point
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw
from sitscad.spec.places import map_columns
from sitscad.spec.sensor import ReadoutSpec, SensorSpec

Document = Mapping[str, Any]

SCRIPTS = ("solids.js", "pushed.js", "page.js")  # Scripts of the page, in running order


def script_text() -> str:
    """Return all scripts of the page as a single text."""
    folder = files("sitscad.files.report") / "assets"
    return "\n".join((folder / name).read_text(encoding="utf-8") for name in SCRIPTS)


def json_script(name: str, document: Document) -> str:
    """Return a script element that holds a document as JSON; `<` is escaped, so that no text ends the element."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>'


OPENING = ("opposing-jaw", "opposing-pad")  # Pieces that turn about the hinge when the jaws open

PIECE_GROUPS = {"board": "board", "tail": "board", "copper": "copper", "glue": "glue"}
"""Groups that are shown and hidden together, by the first part of a piece's name."""

MM = 1e3


def solids_document(glb: bytes, jaw: Jaw | None, pivot: Point | None) -> dict[str, Any]:
    """Return the triangles of ``mount/assembly.glb`` in a compact form.

    Vertices are 16-bit coordinates in the assembly's bounding box (mm, the board's axes), without duplicates within a
    piece. Triangles refer to vertices by number. Each piece has the offsets of its vertices and triangles. `hinge` has
    the pivot and the opening angle if the jaw's hinge is known.
    """
    (length,) = struct.unpack_from("<I", glb, 12)
    scene, body = json.loads(glb[20 : 20 + length]), glb[28 + length :]

    def array(number: int, kind: str, width: int) -> NDArray[Any]:
        accessor = scene["accessors"][number]
        start = scene["bufferViews"][accessor["bufferView"]].get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(body, kind, accessor["count"] * width, start).reshape(-1, width)

    meshes = []
    for node in scene["nodes"]:
        if "mesh" not in node:
            continue
        (primitive,) = scene["meshes"][node["mesh"]]["primitives"]
        x, up, back = MM * array(primitive["attributes"]["POSITION"], "<f4", 3).astype(float).T
        meshes.append((node["name"], scene["materials"][primitive["material"]], np.stack([x, -back, up], axis=1),
                       array(primitive["indices"], "<u4", 1)[:, 0]))
    low = np.min([points.min(axis=0) for _, _, points, _ in meshes], axis=0)
    high = np.max([points.max(axis=0) for _, _, points, _ in meshes], axis=0)
    step = np.maximum(high - low, 1e-6) / (2**16 - 1)
    parts, places, corners, first, start = [], [], [], 0, 0
    for name, material, points, triangles in meshes:
        vertices, which = np.unique(np.rint((points - low) / step).astype("<u2"), axis=0, return_inverse=True)
        *colour, alpha = material["pbrMetallicRoughness"]["baseColorFactor"]
        parts.append({
            "name": name, "group": PIECE_GROUPS.get(name.partition("-")[0], name),
            "colour": [round(value, 4) for value in colour], "alpha": round(alpha, 3),
            "first": first, "start": start, "count": len(triangles),
            "low": round(float(points[:, 2].min()), 4), "opens": name in OPENING,
        })
        places.append(vertices)
        corners.append(which.reshape(-1)[triangles].astype("<u2"))
        first, start = first + len(vertices), start + len(triangles)
    # Pivot (mm; x, z) and opening angle (rad); None if the jaw's hinge is not known
    # Pivot (mm; x, z) and opening angle (rad); None if the jaw's hinge is not known
    jaw, hinge = jaw, None
    if jaw is not None and pivot is not None and jaw.opening:
        hinge = {"pivot": [round(MM * value, 6) for value in pivot], "angle": jaw.opening}
    return {
        "parts": parts, "box": [low.round(6).tolist(), high.round(6).tolist()], "step": step.tolist(),
        "places": base64.b64encode(np.concatenate(places).tobytes()).decode("ascii"),
        "corners": base64.b64encode(np.concatenate(corners).tobytes()).decode("ascii"), "hinge": hinge,
    }


def pushed_document(
    layout: Layout, conversion: Conversion | None, sheet: Document, calibration: Document | None
) -> dict[str, Any] | None:
    """Return the data of the pushed sensor; None if response table, converter settings, pad or target are missing.

    They are the response table of ``datasheet.json``, the map of ``calibration.json``, the converter's scaling of
    counts, and the shapes (mm) of two sections, along x and along y.
    """
    table, spec = sheet.get("pushed"), layout.spec
    pad, target = plates_of(spec).elastomer, plates_of(spec).target
    if table is None or conversion is None or pad is None or target is None:
        return None
    plates = [body.footprint.box for body in (pad, target)]
    coils = [coil_extent(spec.coil, coil) for coil in layout.coils]
    axes = [
        {
            "board": _shown_range([layout.body], k), "pad": _shown_range(plates[:1], k),
            "target": _shown_range(plates[1:], k),
            "coils": [_shown_range([coil], k) for coil in coils], "middle": sum(_shown_range(plates[1:], k)) / 2,
        }
        for k in (0, 1)
    ]
    map_document = None if calibration is None else calibration["map"] | {"least": LEAST, "beyond": BEYOND}
    return {
        "table": table, "map": map_document,
        "conversion": {"counts_per_Hz": float(conversion.counts(np.array(1.0))), "step": conversion.counts_per_step,
                       "offsets": list(conversion.offsets)},
        "shape": {"axes": axes, "pad_mm": MM * spec.elastomer.thickness if spec.elastomer else math.nan,
                  "target_mm": MM * target.thickness},
    }


def _shown_range(boxes: list[tuple[float, float, float, float]], axis: int) -> list[float]:
    """Return the lowest and highest coordinate (mm) of boxes (x0, y0, x1, y1; m) along x (`axis` 0) or y (`axis` 1)."""
    low, high = min(box[axis] for box in boxes), max(box[2 + axis] for box in boxes)
    return [round(MM * low, 4), round(MM * high, 4)]


STYLE = (
    "<style>.swing{position:relative;min-width:12rem;height:1.1rem;background:var(--code);border-radius:.25rem}"
    ".swing i{position:absolute;top:0;bottom:0;background:var(--note)}.swing.full i{background:var(--error)}"
    ".swing::after{content:'';position:absolute;left:50%;top:0;bottom:0;border-left:1px solid var(--soft)}</style>"
)

BAR = (
    '<button type="button" data-do="connect">connect</button><button type="button" data-do="tare">tare: nothing is on '
    'it</button><label>baud <input data-in="baud" value="{}" size="7" inputmode="numeric"></label>'
)


def live_page(
    spec: SensorSpec, estimates: Estimates, calibrations: Sequence[Document] = (), served: bool = False,
    forced: bool = False,
) -> bytes:
    """Return the page of a sensor that shows live forces.

    Parameters
    ----------
    spec : SensorSpec
        The sensor.
    estimates : Estimates
        Its estimates, with the converter's settings.
    calibrations : sequence
        Calibration documents with the maps of the forces, one per cell. Without any, the page shows no forces.
    served : bool
        Whether the page reads a server's events. Otherwise it reads a serial port.
    forced : bool
        Whether the page has the warning of a forced package.

    Raises
    ------
    ValueError
        If the sensor cannot be read, or a map belongs to another sensor.
    """
    maps = []
    for calibration in (calibration.get("map", calibration) for calibration in calibrations):
        coil_numbers, prefix = map_columns(spec, calibration["coils"])  # indices of its coils, prefix of its axes
        maps.append({**calibration, "least": LEAST, "beyond": BEYOND, "columns": coil_numbers, "prefix": prefix})
    document = _live_document(spec.name, spec.readout, estimates.all_coils, estimates.readout, maps)
    document["source"] = "events" if served else "serial"
    names = [coil["name"] for coil in document["coils"]]
    baud = serial_settings(spec.all_placements, spec.cells, estimates.readout.scan_rate).baud
    bar = "" if served else BAR.format(baud)
    if not served and maps:
        bar += '<label>calibration.json <input type="file" accept=".json" data-in="calibration"></label>'
    warning = f"<p class='banner'>{escape(FORCED)}.</p>" if forced else ""
    folder = files("sitscad.files.report") / "assets"
    scripts = "\n".join((folder / name).read_text(encoding="utf-8") for name in ("pushed.js", "readings.js"))
    parts = [
        f"{STYLE}<header><h1>{escape(spec.name)}, live</h1><p class='signal' data-out='said' role='status'></p>"
        f"<p class='soft' data-out='lines'></p></header>{warning}<div class='bar'>{bar}</div>",
        html_section("Forces", _force_rows_html(
            maps, all(calibration.get("is_calibrated") for calibration in calibrations))),
        html_section("Coils", _live_table(
            ("coil", "state", "counts", "Hz", "change, Hz", "change"),
            [(name, *(f"{what}.{name}" for what in ("status", "counts", "frequency_Hz", "change_Hz", "bar")))
             for name in names],
        )),
        json_script("readings-data", document), f"<script>{scripts}</script>",
    ]
    return html_page(f"{spec.name}, live", parts).encode("utf-8")


def _live_document(
    name: str, spec_readout: ReadoutSpec, coils: tuple[CoilEstimate, ...], readout: ReadoutEstimate,
    maps: Sequence[Document],
) -> dict[str, Any]:
    """Return the data for the page's script: the sensor's identity, Hz per count, the coils, the maps."""
    conversion, coil_bands = readout.conversion, frequency_bands(coils, usual_value("coil_inductance"))
    if conversion is None:
        raise ValueError(f"{name} has no converter that is set")
    per_hz = 1.0 / conversion.hertz_per_count
    spans = [
        {
            "name": band.coil, "rest": round(band.assembled.design * per_hz),
            "span": max(round((band.working.high - band.assembled.high) * per_hz), 1),
        }
        for band in coil_bands
    ]
    number = board_identity(name, devices(spec_readout, coils, readout))
    return {
        "name": name, "id": f"{number:08X}", "hz_per_count": 1.0 / per_hz, "status": list(STATUS), "coils": spans,
        "maps": maps,
    }


def _force_rows_html(maps: Sequence[Document], is_calibrated: bool) -> str:
    if not maps:
        return "<p>There is no map to newtons: this sensor has no target on a pad, or no calibration was given.</p>"
    by = (
        "Forces by the calibration of this sensor." if is_calibrated else
        "Forces by the map of the sensor as it is drawn: calibrate yours, and give its calibration.json."
    )
    axes = [(map_document["prefix"], axis, error) for map_document in maps
            for axis, error in zip(map_document["axes"], map_document["error"], strict=True)]
    rows = [(f"{prefix.replace('.', ' ')}{AXIS_WORDS[axis]}{', N mm' if axis in MOMENTS else ''}",
             *(f"{what}.{prefix}{axis}" for what in ("force_N", "sigma_N", "bar"))) for prefix, axis, _ in axes]
    table = _live_table(("axis", "N", "+- N, over all loads", "of full scale"), rows)
    for prefix, axis, error in axes:
        name = f'data-out="sigma_N.{escape(prefix)}{axis}">'
        table = table.replace(name, f"{name}{1e3 * error if axis in MOMENTS else error:.2g}")
    return f"{table}<p class='warned' data-out='range'></p><p class='soft' data-out='map'>{by}</p>"


def _live_table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table filled by the script; a row has its name first, then identifiers of cells."""
    def cell(name: str) -> str:
        if name.startswith("bar."):
            return f'<td><div class="swing"><i data-out="{escape(name)}"></i></div></td>'
        return f'<td class="number" data-out="{escape(name)}"></td>'

    body = "".join(
        f'<tr><th scope="row">{escape(first)}</th>{"".join(map(cell, names))}</tr>' for first, *names in rows
    )
    names = ("", *rows[0][1:])
    heading = "".join(
        f"<th{'' if not name or name.startswith('bar.') else ' class=number'}>{escape(word)}</th>"
        for word, name in zip(head, names, strict=True)
    )
    return f"<div class='scroll'><table><thead><tr>{heading}</tr></thead><tbody>{body}</tbody></table></div>"
