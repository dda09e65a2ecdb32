"""Where `sitscad read` sends what it reads, while it reads: a page with moving bars, lines of JSON over UDP."""

from __future__ import annotations

import json
import math
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from sitscad.bench.board import Board
from sitscad.bench.readings import Forces, Scan, plain
from sitscad.cli.watching import served
from sitscad.estimates.circuit.bands import STATUS
from sitscad.report.live import live_page
from sitscad.watch.server import Showing

SHOWN = 1.0 / 30.0
"""Seconds from one reading that is shown on the page to the next."""


@contextmanager
def sinks(
    board: Board, forces: Forces, udp: str | None, page: tuple[Sequence[Path], int] | None
) -> Iterator[Callable[[Scan], None]]:
    """What is done with every scan: sent as a line of JSON to HOST:PORT, shown on a page (the calibrations that it
    reads forces by, its port). Raises ValueError for what is no such address, OSError for a port that is taken.
    """
    with ExitStack() as end:
        wire = None if udp is None else end.enter_context(_wire(udp))
        showing = None
        if page is not None:
            calibrations, port = page
            known = [json.loads(path.read_text(encoding="utf-8")) for path in calibrations]
            showing = Showing(live_page(board.design.spec, board.design.estimates, known, served=True))
            end.callback(served(showing, "127.0.0.1", port)[0].shutdown)
        last, newest = -math.inf, dict[int, tuple[int, int]]()

        def tell(scan: Scan) -> None:
            nonlocal last
            row = plain(board, scan, forces(board, scan))
            if wire is not None:
                with suppress(ConnectionRefusedError):  # nobody listens yet
                    wire.send((json.dumps(row) + "\n").encode("ascii"))
            newest.update({k: (one.counts, STATUS.index(one.status)) for k, one in scan.items()})
            if showing is not None and len(newest) == len(board.bands) and time.monotonic() - last > SHOWN:
                last = time.monotonic()
                counts, status = zip(*(newest[k] for k in range(len(board.bands))), strict=True)
                told = {"counts": counts, "status": status, "tare": forces.tare(board)}
                showing.post({"stage": "reading", **told})

        yield tell


def _wire(address: str) -> socket.socket:
    """A socket that sends to HOST:PORT. Raises ValueError for what is none."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 1 << 16:
        raise ValueError(f"--udp takes HOST:PORT, like 127.0.0.1:9870, not {address!r}")
    try:
        family, kind, _, _, where = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_DGRAM)[0]
    except OSError as error:
        raise ValueError(f"--udp {address}: {error}") from error
    made = socket.socket(family, kind)
    made.connect(where)
    return made
