"""The page of moving bars that `sitscad read --serve` shows while it reads."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from sitscad.bench.board import Board
from sitscad.bench.readings import Forces, Scan
from sitscad.cli.watching import served
from sitscad.estimates.circuit.bands import STATUS
from sitscad.report.live import live_page
from sitscad.watch.server import Showing

INTERVAL = 1.0 / 30.0
"""Shortest time between two readings that the page shows, in seconds."""


@contextmanager
def live(board: Board, forces: Forces, calibrations: Sequence[Path], port: int) -> Iterator[Callable[[Scan], None]]:
    """A function that shows a scan on the page, which a server of this machine has at a port until the context ends.

    The page computes newtons by the calibrations (paths of calibration.json). Raises ClickException if the server
    cannot listen.
    """
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
