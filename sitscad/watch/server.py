"""The page of a watched spec over HTTP: the page as far as it is ready, what is told while it is, and the last of it.

Standard library only. It answers programs on this machine that ask for it by the name that it was given; a page of
somebody else's that asks by another name (DNS rebinding) is refused, and so is every path but its own three.
"""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

from sitscad.drawing.web_page import page
from sitscad.report.moving import scripts
from sitscad.watch.watching import changes, verdict
from sitscad.watch.work import Event

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine for itself."""

ALIVE = 10.0
"""Seconds after which a listener is sent an empty line, so that one that has gone is noticed."""

MOST_WAITING = 1000
"""Events that wait for one listener."""

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'"
"""What the page may load: nothing but what is in it, and from here."""

EMPTY = "<header><h1>sitscad watch</h1><p>The first findings come as soon as the spec can be read.</p></header>"


class Showing:
    """What is shown now: the page (left out: one that a watched spec fills), the last event of every stage, and who
    listens.
    """

    def __init__(self, shown: bytes = b"") -> None:
        self.lock = threading.Lock()
        script = (files("sitscad.report") / "assets" / "live.js").read_bytes()
        self.follows = b"" if shown else b"<script>" + script + b"</script>"
        self.page = shown or page("sitscad watch", [EMPTY, f"<script>{scripts()}</script>"]).encode()
        self.state: dict[str, dict[str, Any]] = {}
        self.listeners: set[queue.Queue[bytes]] = set()

    def tell(self, revision: int, event: Event, before: Event | None) -> None:
        """Take an event up and tell all who listen."""
        data: dict[str, Any] = {"stage": event.stage, "revision": revision, "seconds": round(event.seconds, 3)}
        data |= event.data | {"changes": changes(event, before), "has_page": bool(event.page)}
        if event.stage == "findings":
            data["verdict"] = verdict(event.data)
        self.post(data, event.page)

    def post(self, data: dict[str, Any], shown: bytes | None = None) -> None:
        """Tell all who listen of a stage, and keep that for those who come; who does not follow misses some."""
        with self.lock:
            self.page = shown or self.page
            self.state[data["stage"]] = data
            for listener in self.listeners:
                if listener.qsize() < MOST_WAITING:
                    listener.put(_line(data))

    def listen(self) -> Iterator[bytes]:
        """Every event from now on, and first the last ones."""
        own: queue.Queue[bytes] = queue.Queue()
        with self.lock:
            told = list(map(_line, self.state.values()))
            self.listeners.add(own)
        try:
            yield from told or [b": nothing yet\n\n"]
            while True:
                try:
                    yield own.get(timeout=ALIVE)
                except queue.Empty:
                    yield b": alive\n\n"
        finally:
            with self.lock:
                self.listeners.discard(own)


def _line(data: dict[str, Any]) -> bytes:
    return f"data: {json.dumps(data)}\n\n".encode()


def server(showing: Showing, host: str, port: int) -> ThreadingHTTPServer:
    """A server that shows it, begun by its `serve_forever`. Raises OSError where the port is taken."""

    class Handler(BaseHTTPRequestHandler):
        """Answers one request."""

        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            """The page, its events, or its state."""
            if self.headers.get("Host", "") not in names:
                self._answer(403, "text/plain", b"this page is not for that host\n")
            elif self.path == "/":
                live = showing.page.replace(b"</main>", b"</main>" + showing.follows, 1)
                self._answer(200, "text/html; charset=utf-8", live)
            elif self.path == "/state":
                with showing.lock:
                    state = json.dumps(showing.state).encode()
                self._answer(200, "application/json", state)
            elif self.path == "/events":
                self._events()
            else:
                self._answer(404, "text/plain", b"there is no such page\n")

        def _answer(self, code: int, kind: str, content: bytes) -> None:
            self.send_response(code)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self._about()
            self.end_headers()
            self.wfile.write(content)

        def _about(self) -> None:
            for name, value in (("Cache-Control", "no-store"), ("Content-Security-Policy", POLICY),
                                ("X-Content-Type-Options", "nosniff")):
                self.send_header(name, value)

        def _events(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Connection", "close")
            self._about()
            self.end_headers()
            self.close_connection = True
            try:
                for line in showing.listen():
                    self.wfile.write(line)
                    self.wfile.flush()
            except OSError:
                return  # the reader has gone

        def log_message(self, format: str, *args: object) -> None:
            """Nothing: the terminal is for what has changed."""

    made = ThreadingHTTPServer((host, port), Handler)
    made.daemon_threads = True
    own = made.server_address[1]
    own_names = {"127.0.0.1", "localhost", "[::1]"} | ({host} if host not in LOOPBACK else set())
    names = {f"{name}:{own}" for name in own_names}
    return made
