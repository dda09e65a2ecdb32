"""`sitscad watch`: a spec looked at while it is edited."""

from __future__ import annotations

import json
import shutil
import sys
import threading
import webbrowser
from typing import TYPE_CHECKING

import click

from sitscad.cli.terminal import Example, print_result, say

if TYPE_CHECKING:
    from sitscad.watch.server import PageServer, Showing


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
    from sitscad.watch.server import Showing
    from sitscad.watch.watching import OVERTAKEN, Watch, words
    from sitscad.watch.work import Event

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
    from sitscad.watch.server import LOOPBACK, server

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
