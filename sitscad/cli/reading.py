"""`sitscad read` and `sitscad watch`: a board on the bench or a simulated board, and a spec while it is edited."""

from __future__ import annotations

import json
import math
import shutil
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path

import click

from sitscad.apps.hardware.bench_board import Board
from sitscad.apps.hardware.diagnosis import (
    NOT_MET,
    TARES,
    Forces,
    Scan,
    diagnose_board,
    read_scans,
    scan_document,
    scan_lines,
    scan_table,
    verdict_lines,
)
from sitscad.apps.hardware.source import SERIAL, open_source, read_design
from sitscad.apps.watch.server import LOOPBACK, PageServer, PageState, make_server
from sitscad.apps.watch.watching import OVERTAKEN, Watch, event_lines
from sitscad.apps.watch.work import Event
from sitscad.calibration import map_of
from sitscad.cli.terminal import DAY, Example, InRange, print_message, print_result, write_output
from sitscad.estimates.circuits.settings import STATUS
from sitscad.files.report.moving import live_page


@click.command(
    "read", cls=Example, example="sitscad read 'sim:sensor.yaml?load=normal:0:5&seconds=2&fault=open:C2' --diagnose"
)
@click.argument("source")
@click.option("--design", type=click.Path(), help="The board's spec or package (sim: its own).")
@click.option("--calibration", type=click.Path(exists=True, path_type=Path),
              help="Show newtons, by calibration.json of this sensor or by a folder with the files of all cells.")
@click.option("--tare", is_flag=True, help="Count newtons from the mean of the first 16 scans, without load.")
@click.option("--diagnose", is_flag=True, help="Report the requirements that the board meets, and likely faults.")
@click.option("--seconds", type=InRange(0, DAY, min_open=True), help="Duration (default: 2, or the duration of sim:).")
@click.option("--every", type=InRange(0, DAY), default=0, help="Seconds between two scans (default: every scan).")
@click.option("--serve", is_flag=True, help="Show moving bars as a page on this machine, until Ctrl-C.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="The page's port (default: a free one).")
@click.option("--log", type=click.Path(file_okay=False), help="Folder for readings.csv and readings.json.")
def read(
    source: str, design: str | None, calibration: Path | None, tare: bool, diagnose: bool, seconds: float | None,
    every: float, serve: bool, port: int, log: str | None,
) -> int:
    """Set up a board's converters and print a line for each scan, or a diagnosis.

    \b
    SOURCE is one of these:
      sim:SPEC            a simulated board, with the options below
      /dev/i2c-N          the I2C bus of a Linux computer; two buses:
                          /dev/i2c-N,/dev/i2c-M
      serial:PORT         a microcontroller with the package's firmware; ?baud=
                          replaces SENSOR_BAUD of the design

    The last two need pip install 'sitscad[bench]'. Lines that are lost, corrupted or of another sensor are counted and
    not used.

    \b
    Options of sim:, after ? and separated by &:
      load=               AXIS:FIRST:LAST with the axes normal, shear_x,
                          shear_y (N), moment_x, moment_y (N mm); several
                          axes: load=normal:0:5,shear_x:2
      seconds=            duration
      fault=              open, short, lost-layer, low-amplitude, swapped, nack,
                          stuck, reset, glitch, with :COIL and @SECONDS
      state=free          a bare board
      unit=               number of a sensor with errors of manufacture
      cell=               cell under the load
      seed=               seed of the noise
      temperature=        FIRST:LAST (degrees Celsius), or a table with the
                          columns time_s,celsius: the ambient temperature

    If the calibration has coefficients of drift, --tare adds newtons that are compensated by the temperature change
    since the tare. The reference coil or the simulated temperature sensor measures it.

    Newtons count from the calibration's tare, or with --tare from the mean of the first 16 scans. The loads of a
    simulated board begin after these scans.

    With --serve it reads until Ctrl-C, unless --seconds sets the duration. A simulated board then runs in real time.

    Exit code: 0 good, 1 --diagnose found a requirement that is not met, 2 there is no such source, or no answer.
    """  # noqa: D301 - click needs the control character itself
    keeps_scans = diagnose or log is not None or not serve
    rows, wrong = [], list[str]()
    try:
        wanted = None if design is None else read_design(design)
        origin, board_design = open_source(source, wanted, TARES if tare else 0)
        maps = _maps(calibration)
        forces = Forces([map_of(path) for path in maps], tare, origin.celsius)
        board = origin.board(board_design)
        origin.paced = origin.paced or serve
        with live(board, forces, maps, port) if serve else nullcontext() as show:
            wrong = board.set_up()
            try:
                duration = seconds or (math.inf if serve else origin.seconds or USUAL)
                for scan in read_scans(board, origin, duration, every):
                    rows += [scan] if keeps_scans else []
                    forces.add_to_tare(board, scan)
                    forces(board, scan)  # raises ValueError for a map of another sensor
                    if show is not None:
                        show(scan)
            except KeyboardInterrupt:
                print_message("stopped")
        verdicts = diagnose_board(board, wrong, [[row[k] for row in rows if k in row] for k in range(len(board.bands))])
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    except OSError as error:
        hint = "" if source.startswith(SERIAL) else ": SD low, supply, pull-ups, address by ADDR"
        print_result(f"NOT MET        answer  {error}{hint}\n")
        return 2
    if board.remark:
        print_message(board.remark)
    if tare and calibration and forces.mean is None:
        print_message(f"no newtons: a tare is the mean of {TARES} scans with good readings, "
                      f"and {len(forces.taken)} came")
    if log:
        _write_log(Path(log), board, rows, source)
    if diagnose or not serve:
        print_result("\n".join(verdict_lines(verdicts) if diagnose else scan_lines(board, rows, forces)) + "\n")
    return int(diagnose and any(each.verdict == NOT_MET for each in verdicts))


def _maps(place: Path | None) -> list[Path]:
    """Return the path `place` of a calibration.json, or the paths of all such files in and below this folder.

    Empty if `place` is None. Raises ValueError if the folder has none.
    """
    if place is None or place.is_file():
        return [] if place is None else [place]
    paths = sorted(place.glob("**/calibration.json"), key=lambda path: (len(str(path)), str(path)))
    if not paths:
        raise ValueError(f"there is no calibration.json in {place}")
    return paths


def _write_log(folder: Path, board: Board, rows: Sequence[Scan], source: str) -> None:
    """Write the scans to readings.csv, and the data that describe board and source to readings.json."""
    folder.mkdir(parents=True, exist_ok=True)
    write_output(folder / "readings.csv", scan_table(board, rows))
    write_output(folder / "readings.json", scan_document(board, source))
    print_message(f"wrote {folder / 'readings.csv'}")


USUAL = 2.0
"""Default time (s) for which a board is read."""


INTERVAL = 1.0 / 30.0
"""Shortest time (s) between two readings that the page shows."""


@contextmanager
def live(board: Board, forces: Forces, calibrations: Sequence[Path], port: int) -> Iterator[Callable[[Scan], None]]:
    """Serve the live page until the context ends. Yield a function that shows a scan on the page.

    The page computes newtons with the files `calibrations` (calibration.json). Raises ClickException if the server
    cannot listen.
    """
    maps = [json.loads(path.read_text(encoding="utf-8")) for path in calibrations]
    showing = PageState(live_page(board.design.spec, board.design.estimates, maps, served=True))
    page_server, _ = start_server(showing, "127.0.0.1", port)
    last, newest = -math.inf, dict[int, tuple[int, int]]()

    def show(scan: Scan) -> None:
        nonlocal last
        newest.update({k: (reading.counts, STATUS.index(reading.status)) for k, reading in scan.items()})
        if len(newest) == len(board.bands) and time.monotonic() - last > INTERVAL:
            last = time.monotonic()
            counts, status = zip(*(newest[k] for k in range(len(board.bands))), strict=True)
            showing.publish_data({"stage": "reading", "counts": counts, "status": status, "tare": forces.tare(board)})

    try:
        yield show
    finally:
        page_server.shutdown()


@click.command(cls=Example, example="sitscad watch sensor.yaml --serve --open")
@click.argument("spec", type=click.Path(exists=True, dir_okay=False))
@click.option("--serve", is_flag=True, help="Show the report as a page that follows every save.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="The page's port (default: a free one).")
@click.option("--host", default="127.0.0.1", show_default=True,
              help="Address to serve on; other addresses than this machine's give a warning.")
@click.option("--open", "opens", is_flag=True, help="Open the page in a browser.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json",
              type=click.Choice(["text", "json"]))
@click.option("-v", "--verbose", is_flag=True, help="Print all changes.")
def watch(spec: str, serve: bool, port: int, host: str, opens: bool, format_name: str, verbose: bool) -> int:
    """Report what every save of SPEC changes, until Ctrl-C.

    A dozen lines show the changes. Findings are new (+), gone (-) or changed (~). For every quantity, the number with
    the largest change is printed as old -> new. The sensing performance and the verdict follow. With --serve, a page
    shows the same, with the board, an interactive sensor and the assembly in 3-D. Each part appears when it is ready.
    A save ends the work in progress.

    SPEC can also be a study (docs/studies.md). Then the first designs of its search are evaluated and reported.
    """
    showing, page_server = PageState(), None
    serve = serve or opens
    if serve:
        page_server, address = start_server(showing, host, port)

    def told(revision: int, event: Event, before: Event | None) -> None:
        if format_name == "json":
            print_result(json.dumps({"stage": event.stage, "revision": revision, **event.data}))
        else:
            for line in event_lines(revision, event, before, shutil.get_terminal_size().columns, verbose):
                print_result(line)
        sys.stdout.flush()
        if event.stage == OVERTAKEN:
            return  # the page waits for the next save
        showing.publish_event(revision, event, before)
        if opens and revision == 1 and event.stage == "findings":
            webbrowser.open(address)

    try:
        Watch(spec, serve).run(told)
    except KeyboardInterrupt:
        return 0
    finally:
        if page_server is not None:
            page_server.shutdown()
    return 0


def start_server(showing: PageState, host: str, port: int) -> tuple[PageServer, str]:
    """Start a server of the page, print its address and return both. Raises ClickException if it cannot listen."""
    try:
        page_server = make_server(showing, host, port)
    except (OSError, UnicodeError) as error:  # UnicodeError: the host is not a valid name
        reason = getattr(error, "strerror", None) or str(error)
        raise click.ClickException(f"the page cannot be served on {host}, port {port}: {reason}") from error
    if host.strip("[]").lower() not in LOOPBACK:
        print_message("whoever reaches this machine can read the page")
    print_result(page_server.url)
    sys.stdout.flush()
    threading.Thread(target=page_server.serve_forever, daemon=True).start()
    return page_server, page_server.url
