"""`sitscad read`: a board on the bench, or a simulated one."""

from __future__ import annotations

import click

import sitscad
from sitscad.cli.terminal import Example, print_result, say


@click.command(
    "read", cls=Example, example="sitscad read 'sim:sensor.yaml?load=normal:0:5&seconds=2&fault=open:C2' --diagnose"
)
@click.argument("source")
@click.option("--design", type=click.Path(), help="The spec or the package that the board is of (sim: its own).")
@click.option("--calibration", type=click.Path(exists=True, dir_okay=False),
              help="calibration.json of this sensor: newtons are shown, too.")
@click.option("--tare", is_flag=True, help="The first scan is without load: newtons count from it.")
@click.option("--diagnose", is_flag=True, help="Say what the board does and does not, and what a miss probably is.")
@click.option("--seconds", type=click.FloatRange(min=0.0, min_open=True), help="How long (sim: what it says; else 2).")
@click.option("--log", type=click.Path(file_okay=False), help="Folder for readings.csv and readings.json.")
def read(
    source: str, design: str | None, calibration: str | None, tare: bool, diagnose: bool, seconds: float | None,
    log: str | None,
) -> int:
    """Set up a board's converters and read them: a line a scan, or a diagnosis.

    SOURCE is sim:SPEC with ?load=AXIS:FIRST:LAST (normal, shear_x or shear_y, in newtons), seconds=, fault= (open,
    short, lost-layer, low-amplitude, swapped, nack, stuck, reset, glitch, with :COIL and @SECONDS), state=free for a
    bare board, unit= for the sensor of that number, with errors of its own, seed=; /dev/i2c-N of a Linux computer; or
    serial:PORT with ?baud=, where a microcontroller with the firmware of the package is (both: pip install
    'sitscad[bench]'). Lines that are lost, corrupted or of another sensor are counted and not used.

    Newtons are by the tare that the calibration was made with, or by --tare of the first scan.

    Exit code: 0 good, 1 --diagnose found something that is not met, 2 there is no such source, or no answer.
    """
    from pathlib import Path

    from sitscad.bench.diagnosis import NOT_MET, diagnosis, words
    from sitscad.bench.readings import document, lines, scans, table
    from sitscad.bench.source import SERIAL, design_of, source_of
    from sitscad.package.folder import write_file

    try:
        given, known = source_of(source, None if design is None else design_of(design))
        newtons = None if calibration is None else sitscad.map_of(calibration)
        board = given.board(known)
        wrong = board.set_up()
        rows = list(scans(board, given, seconds or given.seconds or USUAL))
        verdicts = diagnosis(board, wrong, [[row[k] for row in rows if k in row] for k in range(len(board.bands))])
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    except OSError as error:
        hint = "" if source.startswith(SERIAL) else ": SD low, supply, pull-ups, address by ADDR"
        print_result(f"NOT MET        answer  {error}{hint}\n")
        return 2
    if board.said:
        say(board.said)
    if log:
        Path(log).mkdir(parents=True, exist_ok=True)
        write_file(Path(log) / "readings.csv", table(board, rows))
        write_file(Path(log) / "readings.json", document(board, source))
        say(f"wrote {Path(log) / 'readings.csv'}")
    told = words(verdicts) if diagnose else lines(board, rows, newtons, tare)
    print_result("\n".join(told) + "\n")
    return int(diagnose and any(one.verdict == NOT_MET for one in verdicts))


USUAL = 2.0
"""Seconds that a board is read where nothing says how long."""
