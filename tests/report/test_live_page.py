"""`live.html` in a browser: lines of a stubbed serial port become counts, frequencies and forces; what is damaged is
counted; a browser without Web Serial says so.
"""

from __future__ import annotations

import binascii
import json
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from tolerance import approx

import sitscad
from sitscad.files.report.moving import live_page

pytestmark = [pytest.mark.clients("chromium"), pytest.mark.slow]

TEMPLATE = Path(__file__).parents[2] / "templates" / "bench_7mm.yaml"

STUB = """
Object.defineProperty(navigator, "serial", {value: %s, configurable: true});
"""
PORT = """{requestPort: async () => ({
  open: async options => { window.opened = options; },
  readable: new ReadableStream({start(control) {
    window.send = text => control.enqueue(new TextEncoder().encode(text));
  }}),
})}"""


def _line(*cells: object) -> str:
    text = ",".join(map(str, cells))
    return f"{text}*{binascii.crc_hqx(text.encode(), 0xFFFF):04X}\r\n"


def _out(page: Browser, name: str) -> str:
    return str(page.run(f"document.querySelector('[data-out=\"{name}\"]').textContent"))


def _opened(page: Browser, folder: Path, text: str, said: str, where: str = "said") -> None:
    """Open a file as calibration.json, and wait until the page says so."""
    path = folder / "calibration.json"
    path.write_text(text)
    page.run(f"document.querySelector('[data-out={where}]').textContent = ''")
    root = page.call("DOM.getDocument")["root"]["nodeId"]
    node = page.call("DOM.querySelector", nodeId=root, selector="[data-in=calibration]")["nodeId"]
    page.call("DOM.setFileInputFiles", nodeId=node, files=[str(path)])
    page.run(f"new Promise(done => {{ (function look() {{ document.querySelector('[data-out={where}]').textContent"
             f".includes({json.dumps(said)}) ? done(1) : setTimeout(look, 5); }})(); }})")


def test_serial_lines_give_forces_and_damaged_lines_are_counted(tmp_path):
    design = sitscad.Design(sitscad.load(TEMPLATE))
    result = sitscad.calibrate(design)
    path = tmp_path / "live.html"
    path.write_bytes(live_page(design.spec, design.estimates, [result.document()]))
    loads = np.array([[0.0, 0, 0], [2.0, 0.3, 0]])
    frequency = sitscad.respond(design, loads=loads, rotation="held").frequency
    rest, pushed = np.rint(result.sensors.conversion.counts(frequency)).astype(int).tolist()
    known = json.loads(path.read_text().split('id="readings-data">')[1].split("</script>")[0])["id"]

    def reading(number: int, counts: list[int], status: int = 0) -> str:
        return _line(known, number, counts[0], status, counts[1], 0, "0.1", "0.2")

    with Browser() as page:
        stub = page.call("Page.addScriptToEvaluateOnNewDocument", source=STUB % PORT)["identifier"]
        page.open(path)
        page.run("document.querySelector('[data-do=connect]').click()")
        page.run("new Promise(done => { (function look() { window.opened ? done(1) : setTimeout(look, 5); })(); })")
        assert page.run("window.opened.baudRate") == 115200

        def send(text: str, said: str) -> None:
            page.run(f"send({json.dumps(text[:7])}); send({json.dumps(text[7:])})")
            page.run("new Promise(done => { (function look() { document.querySelector('[data-out=lines]').textContent"
                     f" === {json.dumps(said)} ? requestAnimationFrame(() => requestAnimationFrame(done))"
                     " : setTimeout(look, 5); })(); })")

        send("ail,of,one*0000\r\n" + _line("id", "sequence") + "".join(reading(k, rest) for k in range(16)),
             "16 lines, 0 lost, 0 corrupted, 0 of another sensor")
        assert _out(page, "force_N.normal") == "\u2013" and "No forces before a tare" in _out(page, "range")
        page.run("document.querySelector('[data-do=tare]').click()")
        send("".join(reading(k, rest) for k in range(16, 32)), "32 lines, 0 lost, 0 corrupted, 0 of another sensor")
        assert abs(float(_out(page, "force_N.normal"))) < 0.01
        damaged = reading(33, rest).replace(str(rest[0]), str(rest[0] + 1))
        send(damaged + _line(f"{int(known, 16) ^ 1:08X}", 33, 1, 0, 1, 0) + "# words\r\n" + reading(36, pushed),
             "33 lines, 4 lost, 1 corrupted, 1 of another sensor")
        read = result.map(np.array([pushed], dtype=float), np.array(rest, dtype=float))[0]
        assert float(_out(page, "force_N.normal")) == approx(read[0], abs=6e-4)
        assert float(_out(page, "force_N.shear_x")) == approx(read[1], abs=6e-4)
        assert int(_out(page, "counts.C1")) == pushed[0] and _out(page, "said") == "words"
        assert float(_out(page, "frequency_Hz.C2")) == approx(frequency[1, 1], rel=1e-6)
        document = result.document()
        twice = document | {"is_calibrated": True, "map": document["map"] | {
            "coefficients": [[2.0 * value for value in row] for row in document["map"]["coefficients"]]}}
        lacking = twice | {"map": {key: value for key, value in twice["map"].items() if key != "error"}}
        _opened(page, tmp_path, json.dumps(twice), "calibration that was opened", "map")
        for text, said in (
            ("{", "no calibration.json"), ("null", "no calibration.json"), (json.dumps(lacking), "no calibration.json"),
            (json.dumps(twice | {"map": twice["map"] | {"sensor": "another"}}), "of another sensor"),
        ):
            _opened(page, tmp_path, text, said)
        send(reading(37, pushed), "34 lines, 4 lost, 1 corrupted, 1 of another sensor")
        assert float(_out(page, "force_N.normal")) == approx(2.0 * read[0], abs=1e-3)
        page.size(1000, 700)
        page.picture(tmp_path / "live.png")
        send(reading(38, pushed, 4), "35 lines, 4 lost, 1 corrupted, 1 of another sensor")
        assert _out(page, "status.C1") == "watchdog" and "no good reading" in _out(page, "range")
        assert _out(page, "force_N.normal") == "\u2013"
        assert page.exceptions == [] and page.requests == [path.as_uri()]
        page.call("Page.removeScriptToEvaluateOnNewDocument", identifier=stub)
        page.call("Page.addScriptToEvaluateOnNewDocument", source=STUB % "undefined")
        page.open(path)
        assert "no Web Serial" in _out(page, "said")
        assert page.run("document.querySelector('[data-do=connect]').disabled")
        assert page.exceptions == []


@pytest.mark.more
def test_each_cell_shows_forces_of_its_map(tmp_path):
    """A reading in which the second alone is pressed; a map of one coil was laid over the counts of all."""
    text = (TEMPLATE.parent / "skin_strip_6.yaml").read_text(encoding="utf-8").replace("count: 6", "count: 2")
    design = sitscad.Design(sitscad.load_text(text))
    result = [sitscad.calibrate(design.cells.by_number(k)) for k in (1, 2)]
    path = tmp_path / "live.html"
    path.write_bytes(live_page(design.spec, design.estimates, [item.document() for item in result]))
    (rest, pushed), idle = (item.sensors.conversion.counts(sitscad.respond(
        design.cells.by_number(k), loads=[[0.0, 0, 0], [3.0, 0, 0]], rotation="held").frequency)[:, 0].round()
        for k, item in ((2, result[1]), (1, result[0])))
    counts = [[int(idle[0]), int(rest)], [int(idle[0]), int(pushed)]]
    with Browser() as page:
        page.open(path)
        page.run(f"sitscad.tare(); for (let k = 0; k < 16; k++) sitscad.take({{counts: {counts[0]}, status: [0, 0]}});"
                 f"sitscad.take({{counts: {counts[1]}, status: [0, 0]}});"
                 "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert float(_out(page, "force_N.C1.normal")) == 0.0
        assert float(_out(page, "force_N.C2.normal")) == approx(3.0, rel=2e-3)
        assert page.exceptions == []
