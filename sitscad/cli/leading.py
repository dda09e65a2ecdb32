"""`sitscad calibrate --from`: the points of a plan taken one after the other on the terminal."""

from __future__ import annotations

from pathlib import Path

import click

import sitscad
from sitscad.cli.terminal import say


def taken_points(
    design: sitscad.Design, found: sitscad.Calibration, source: str, table: str, creep: float | None
) -> bool:
    """Take the points of a plan into a table, written after each, read `creep` seconds after the load was put on;
    whether it is whole. Raises click.UsageError for what is no source of this sensor.
    """
    from sitscad.bench.leading import Leading, NotTaken
    from sitscad.bench.source import source_of
    from sitscad.package.folder import write_file

    path = Path(table)
    try:
        given, _ = source_of(source, design)
        given.creep = given.creep if creep is None else creep
        board = given.board(design)
        wrong = board.set_up()
        if wrong:
            raise NotTaken(f"{', '.join(wrong)} did not read back: the bus, or another part")
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        path.parent.mkdir(parents=True, exist_ok=True)
        for text in Leading(board, given, found, _asked, say).table(before):
            write_file(path, text.encode("utf-8"))
    except (NotTaken, OSError, KeyboardInterrupt, click.Abort) as error:
        say(f"{error or 'stopped'}; the same command goes on after the points in {path}")
        return False
    except ValueError as error:
        raise click.UsageError(f"{source}, {path}: {error}") from error
    return True


def _asked(words: str) -> str:
    """What is typed once the load is on."""
    words = f"{words}; then Enter, or the newtons that are on, or back"
    return str(click.prompt(words, default="", show_default=False, err=True))
