"""The page of a board that is being read: bars of coils and forces, by Web Serial from a disk or served by `read`."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any

from sitscad.calibration.inverse_map import BEYOND, LEAST
from sitscad.calibration.unknowns import usual
from sitscad.drawing.frame import FORCED
from sitscad.drawing.web_page import page, part
from sitscad.estimates import Estimates
from sitscad.estimates.circuit.bands import STATUS, bands
from sitscad.estimates.circuit.settings import devices, identity, serial_settings
from sitscad.estimates.performance.values import AXIS_WORDS, MOMENTS
from sitscad.report.moving import Document, embedded
from sitscad.spec.places import map_columns
from sitscad.spec.sensor import SensorSpec

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
    """The page of one sensor: forces by the map in the document of a calibration, where there is one, of each of its
    cells by the cell's own. From a disk it reads a serial port, `served` the events of a server; of a `forced` package
    it says so. Raises ValueError where the sensor cannot be read, and for maps of others.
    """
    known = []
    for one in (one.get("map", one) for one in calibrations):
        own, prefix = map_columns(spec, one["coils"])  # the places of its coils among all, what stands before its axes
        known.append({**one, "least": LEAST, "beyond": BEYOND, "columns": own, "prefix": prefix})
    document = _document(spec, estimates, known) | {"source": "events" if served else "serial"}
    names = [coil["name"] for coil in document["coils"]]
    baud = serial_settings(len(estimates.coils), estimates.readout.scan_rate).baud
    bar = "" if served else BAR.format(baud)
    if not served and known:
        bar += '<label>calibration.json <input type="file" accept=".json" data-in="calibration"></label>'
    warning = f"<p class='banner'>{escape(FORCED)}.</p>" if forced else ""
    folder = files("sitscad.report") / "assets"
    scripts = "\n".join((folder / name).read_text(encoding="utf-8") for name in ("pushed.js", "readings.js"))
    parts = [
        f"{STYLE}<header><h1>{escape(spec.name)}, live</h1><p class='signal' data-out='said' role='status'></p>"
        f"<p class='soft' data-out='lines'></p></header>{warning}<div class='bar'>{bar}</div>",
        part("Forces", _forces(known, all(one.get("is_calibrated") for one in calibrations))),
        part("Coils", _table(
            ("coil", "state", "counts", "Hz", "change, Hz", "change"),
            [(name, *(f"{what}.{name}" for what in ("status", "counts", "frequency_Hz", "change_Hz", "bar")))
             for name in names],
        )),
        embedded("readings-data", document), f"<script>{scripts}</script>",
    ]
    return page(f"{spec.name}, live", parts).encode("utf-8")


def _document(spec: SensorSpec, estimates: Estimates, known: Sequence[Document]) -> dict[str, Any]:
    """What the page's script reads: by what lines are known, how counts become Hz, the coils, the maps."""
    conversion, found = estimates.readout.conversion, bands(estimates, usual("coil_inductance"))
    if conversion is None:
        raise ValueError(f"{spec.name} has no converter that is set")
    per_hz = 2.0**conversion.device.count_bits / conversion.full_scale
    coils = [
        {
            "name": one.coil, "rest": round(one.assembled.design * per_hz),
            "span": max(round((one.working.high - one.assembled.high) * per_hz), 1),
        }
        for one in found
    ]
    name = identity(spec.name, devices(spec.readout, estimates))
    return {
        "name": spec.name, "id": f"{name:08X}", "hz_per_count": 1.0 / per_hz, "status": list(STATUS), "coils": coils,
        "maps": known,
    }


def _forces(known: Sequence[Document], is_calibrated: bool) -> str:
    if not known:
        return "<p>There is no map to newtons: this sensor has no target on a pad, or no calibration was given.</p>"
    by = (
        "Forces by the calibration of this sensor." if is_calibrated else
        "Forces by the map of the sensor as it is drawn: calibrate yours, and give its calibration.json."
    )
    axes = [(one["prefix"], axis, error) for one in known
            for axis, error in zip(one["axes"], one["error"], strict=True)]
    rows = [(f"{prefix.replace('.', ' ')}{AXIS_WORDS[axis]}{', N mm' if axis in MOMENTS else ''}",
             *(f"{what}.{prefix}{axis}" for what in ("force_N", "sigma_N", "bar"))) for prefix, axis, _ in axes]
    table = _table(("axis", "N", "+- N, over all loads", "of full scale"), rows)
    for prefix, axis, error in axes:
        name = f'data-out="sigma_N.{escape(prefix)}{axis}">'
        table = table.replace(name, f"{name}{1e3 * error if axis in MOMENTS else error:.2g}")
    return f"{table}<p class='warned' data-out='range'></p><p class='soft' data-out='map'>{by}</p>"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A table whose cells are filled by the script: the first of a row is its name, the others are names of cells."""
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
