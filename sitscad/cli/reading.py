"""`sitscad read` and `sitscad watch`: a board on the bench or a simulated one, and a spec looked at while edited."""

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
from typing import TYPE_CHECKING

import click

import sitscad
from sitscad.cli.terminal import DAY, Example, InRange, print_result, say

if TYPE_CHECKING:
    from sitscad.apps.hardware.bench_board import Board
    from sitscad.apps.hardware.diagnosis import Forces, Scan
    from sitscad.apps.watch.server import PageServer, Showing


@click.command(
    "read", cls=Example, example="sitscad read 'sim:sensor.yaml?load=normal:0:5&seconds=2&fault=open:C2' --diagnose"
)
@click.argument("source")
@click.option("--design", type=click.Path(), help="The spec or the package that the board is of (sim: its own).")
@click.option("--calibration", type=click.Path(exists=True, path_type=Path),
              help="calibration.json of this sensor, or the folder with that of every cell: newtons are shown, too.")
@click.option("--tare", is_flag=True, help="Nothing is on it first: newtons count from the mean of the first 16 scans.")
@click.option("--diagnose", is_flag=True, help="Say what the board does and does not, and what a miss probably is.")
@click.option("--seconds", type=InRange(0, DAY, min_open=True), help="How long (sim: what it says; else 2).")
@click.option("--serve", is_flag=True, help="Show moving bars as a page on this machine, until Ctrl-C.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="The page's port (default: a free one).")
@click.option("--log", type=click.Path(file_okay=False), help="Folder for readings.csv and readings.json.")
def read(
    source: str, design: str | None, calibration: Path | None, tare: bool, diagnose: bool, seconds: float | None,
    serve: bool, port: int, log: str | None,
) -> int:
    """Set up a board's converters and read them: a line a scan, or a diagnosis.

    SOURCE is sim:SPEC with ?load=AXIS:FIRST:LAST (normal, shear_x, shear_y in newtons, moment_x, moment_y in newton
    millimetres; of several axes with a comma between: load=normal:0:5,shear_x:2), seconds=, fault= (open, short,
    lost-layer, low-amplitude, swapped, nack, stuck, reset, glitch, with :COIL and @SECONDS), state=free for a bare
    board, unit= for the sensor of that number, with errors of its own, cell= for the cell that the load is on,
    seed=; /dev/i2c-N of a Linux computer (/dev/i2c-N,/dev/i2c-M for two buses); or serial:PORT, where a
    microcontroller with the firmware of the package is (both: pip install 'sitscad[bench]'). The port runs at
    SENSOR_BAUD of the design; ?baud= sets another. Lines that are lost, corrupted or of another sensor are counted
    and not used.

    Newtons are by the tare that the calibration was made with, or with --tare by the mean of the first 16 scans; the
    loads of a simulated board begin after them.

    With --serve it reads until Ctrl-C where --seconds does not say how long, a simulated board as fast as a true one.

    Exit code: 0 good, 1 --diagnose found something that is not met, 2 there is no such source, or no answer.
    """
    from sitscad.apps.hardware.diagnosis import NOT_MET, TARES, Forces, diagnosis, lines, scans, words
    from sitscad.apps.hardware.source import SERIAL, design_of, source_of

    kept = diagnose or log is not None or not serve
    rows, wrong = [], list[str]()
    try:
        given, known = source_of(source, None if design is None else design_of(design), TARES if tare else 0)
        maps = _maps(calibration)
        forces = Forces([sitscad.map_of(path) for path in maps], tare)
        board = given.board(known)
        given.paced = given.paced or serve
        with live(board, forces, maps, port) if serve else nullcontext() as show:
            wrong = board.set_up()
            try:
                for scan in scans(board, given, seconds or (math.inf if serve else given.seconds or USUAL)):
                    rows += [scan] if kept else []
                    forces.take(board, scan)
                    forces(board, scan)  # refuses a map of another sensor
                    if show is not None:
                        show(scan)
            except KeyboardInterrupt:
                say("stopped")
        verdicts = diagnosis(board, wrong, [[row[k] for row in rows if k in row] for k in range(len(board.bands))])
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    except OSError as error:
        hint = "" if source.startswith(SERIAL) else ": SD low, supply, pull-ups, address by ADDR"
        print_result(f"NOT MET        answer  {error}{hint}\n")
        return 2
    if board.said:
        say(board.said)
    if tare and calibration and forces.mean is None:
        say(f"no newtons: a tare is the mean of {TARES} scans with good readings, and {len(forces.taken)} came")
    if log:
        _logged(Path(log), board, rows, source)
    if diagnose or not serve:
        print_result("\n".join(words(verdicts) if diagnose else lines(board, rows, forces)) + "\n")
    return int(diagnose and any(one.verdict == NOT_MET for one in verdicts))


def _maps(place: Path | None) -> list[Path]:
    """The calibration.json at a path, or those in the folders below it. Raises ValueError if there is none."""
    if place is None or place.is_file():
        return [] if place is None else [place]
    found = sorted(place.glob("**/calibration.json"), key=lambda path: (len(str(path)), str(path)))
    if not found:
        raise ValueError(f"there is no calibration.json in {place}")
    return found


def _logged(folder: Path, board: Board, rows: Sequence[Scan], source: str) -> None:
    """Write the readings, and what their numbers need."""
    from sitscad.apps.hardware.diagnosis import document, table
    from sitscad.package.folder import write_file

    folder.mkdir(parents=True, exist_ok=True)
    write_file(folder / "readings.csv", table(board, rows))
    write_file(folder / "readings.json", document(board, source))
    say(f"wrote {folder / 'readings.csv'}")


USUAL = 2.0
"""Seconds that a board is read where nothing says how long."""


INTERVAL = 1.0 / 30.0
"""Shortest time between two readings that the page shows, in seconds."""


@contextmanager
def live(board: Board, forces: Forces, calibrations: Sequence[Path], port: int) -> Iterator[Callable[[Scan], None]]:
    """A function that shows a scan on the page, which a server of this machine has at a port until the context ends.

    The page computes newtons by the calibrations (paths of calibration.json). Raises ClickException if the server
    cannot listen.
    """
    from sitscad.apps.watch.server import Showing
    from sitscad.estimates.circuits.bands import STATUS
    from sitscad.files.report.moving import live_page

    known = [json.loads(path.read_text(encoding="utf-8")) for path in calibrations]
    showing = Showing(live_page(board.design.spec, board.design.estimates, known, served=True))
    server, _ = served(showing, "127.0.0.1", port)
    last, newest = -math.inf, dict[int, tuple[int, int]]()

    def show(scan: Scan) -> None:
        nonlocal last
        newest.update({k: (one.counts, STATUS.index(one.status)) for k, one in scan.items()})
        if len(newest) == len(board.bands) and time.monotonic() - last > INTERVAL:
            last = time.monotonic()
            counts, status = zip(*(newest[k] for k in range(len(board.bands))), strict=True)
            showing.post({"stage": "reading", "counts": counts, "status": status, "tare": forces.tare(board)})

    try:
        yield show
    finally:
        server.shutdown()


@click.command(cls=Example, example="sitscad watch sensor.yaml --serve --open")
@click.argument("spec", type=click.Path(exists=True, dir_okay=False))
@click.option("--serve", is_flag=True, help="Show the report as a page that follows every save.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="The page's port (default: a free one).")
@click.option("--host", default="127.0.0.1", show_default=True, help="Whom to serve; another than this machine warns.")
@click.option("--open", "opens", is_flag=True, help="Open the page in a browser.")
@click.option("--format", "format_name", default="text", show_default=True, metavar="text|json",
              type=click.Choice(["text", "json"]))
@click.option("-v", "--verbose", is_flag=True, help="All that changed, in full.")
def watch(spec: str, serve: bool, port: int, host: str, opens: bool, format_name: str, verbose: bool) -> int:
    """Say what every save of SPEC changes, until Ctrl-C.

    In a dozen lines findings that are new (+), gone (-) or others (~), of every quantity the number that moved most,
    old -> new, what the sensor feels, and last the verdict. With --serve the same as a page: findings, board, numbers,
    the sensor that can be pushed and the assembly in 3-D, each as soon as it is ready. A save ends the work in
    progress.

    Of a study (docs/studies.md) the designs with which its search begins are looked at, and what they show is told
    while they fill up.
    """
    from sitscad.apps.watch.server import Showing
    from sitscad.apps.watch.watching import OVERTAKEN, Watch, words
    from sitscad.apps.watch.work import Event

    showing, made = Showing(), None
    serve = serve or opens
    if serve:
        made, address = served(showing, host, port)

    def told(revision: int, event: Event, before: Event | None) -> None:
        if format_name == "json":
            print_result(json.dumps({"stage": event.stage, "revision": revision, **event.data}))
        else:
            for line in words(revision, event, before, shutil.get_terminal_size().columns, verbose):
                print_result(line)
        sys.stdout.flush()
        if event.stage == OVERTAKEN:
            return  # the page is of the save that comes
        showing.tell(revision, event, before)
        if opens and revision == 1 and event.stage == "findings":
            webbrowser.open(address)

    try:
        Watch(spec, serve).run(told)
    except KeyboardInterrupt:
        return 0
    finally:
        if made is not None:
            made.shutdown()
    return 0


def served(showing: Showing, host: str, port: int) -> tuple[PageServer, str]:
    """Start a server of the page, print its address and return both. Raises ClickException if it cannot listen."""
    from sitscad.apps.watch.server import LOOPBACK, server

    try:
        made = server(showing, host, port)
    except (OSError, UnicodeError) as error:  # UnicodeError: the host is no valid name
        reason = getattr(error, "strerror", None) or str(error)
        raise click.ClickException(f"the page cannot be served on {host}, port {port}: {reason}") from error
    if host.strip("[]").lower() not in LOOPBACK:
        say("whoever reaches this machine can read the page")
    print_result(made.url)
    sys.stdout.flush()
    threading.Thread(target=made.serve_forever, daemon=True).start()
    return made, made.url
