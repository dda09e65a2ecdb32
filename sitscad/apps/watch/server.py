"""HTTP server for the page of a watched spec. Its three paths are the page, its events, and the latest state.

It uses the standard library only. It answers requests whose Host header is a name or address of this computer. Other
host names are refused, because a foreign web page can send them by DNS rebinding. Other paths are refused, too.
"""

from __future__ import annotations

import json
import queue
import re
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from ipaddress import ip_address
from socketserver import TCPServer
from typing import Any, cast

from sitscad.apps.watch.watching import event_changes, verdict_text
from sitscad.apps.watch.work import Event
from sitscad.files.drawing.web_page import html_page
from sitscad.files.report.moving import script_text

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Host names and addresses of this computer for requests from itself."""

ALIVE = 10.0
"""Time (s) without an event after which a listener gets an empty line. This detects closed connections."""

MOST_WAITING = 1000
"""Largest number of events in the queue of one listener."""

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'"
"""Content security policy: the page may load only its own content, and data from this server."""

EMPTY = "<header><h1>sitscad watch</h1><p>The first findings come as soon as the spec can be read.</p></header>"


class PageState:
    """The present page, the last event of each stage, and the listeners.

    `shown` is the first page. Without it, the page waits for a watched spec.
    """

    def __init__(self, shown: bytes = b"") -> None:
        self.lock = threading.Lock()
        script = (files("sitscad.files.report") / "assets" / "live.js").read_bytes()
        self.follows = b"" if shown else b"<script>" + script + b"</script>"
        self.page = shown or html_page("sitscad watch", [EMPTY, f"<script>{script_text()}</script>"]).encode()
        self.state: dict[str, dict[str, Any]] = {}
        self.listeners: set[queue.Queue[bytes]] = set()

    def publish_event(self, revision: int, event: Event, before: Event | None) -> None:
        """Store an event of save number `revision` and send it to all listeners.

        `before` is the last event of the same stage.
        """
        data: dict[str, Any] = {"stage": event.stage, "revision": revision, "seconds": round(event.seconds, 3)}
        data |= event.data | {"changes": event_changes(event, before), "has_page": bool(event.page)}
        if event.stage == "findings":
            data["verdict"] = verdict_text(event.data)
        self.publish_data(data, event.page)

    def publish_data(self, data: dict[str, Any], shown: bytes | None = None) -> None:
        """Store the data of a stage for later listeners and send it to all listeners.

        Listeners with a full queue miss it.
        """
        with self.lock:
            self.page = shown or self.page
            self.state[data["stage"]] = data
            for listener in self.listeners:
                if listener.qsize() < MOST_WAITING:
                    listener.put(_event_line(data))

    def listen(self) -> Iterator[bytes]:
        """Yield the last event of each stage, then each new event, as lines of an event stream."""
        events: queue.Queue[bytes] = queue.Queue()
        with self.lock:
            lines = list(map(_event_line, self.state.values()))
            self.listeners.add(events)
        try:
            yield from lines or [b": nothing yet\n\n"]
            while True:
                try:
                    yield events.get(timeout=ALIVE)
                except queue.Empty:
                    yield b": alive\n\n"
        finally:
            with self.lock:
                self.listeners.discard(events)


def _event_line(data: dict[str, Any]) -> bytes:
    return f"data: {json.dumps(data)}\n\n".encode()


def make_server(showing: PageState, host: str, port: int) -> PageServer:
    """Return a server for the page. `serve_forever` starts it. Raises OSError if it cannot listen at this address."""

    class Handler(_PageHandler):
        def do_GET(self) -> None:
            """Send the page, its events, or its state."""
            self.server.deadlines.pop(self.request, None)
            if not self.server.is_own_host(self.headers.get("Host", "")):
                self._send_response(403, "text/plain", b"this page is not for that host\n")
            elif self.path == "/":
                live = showing.page.replace(b"</main>", b"</main>" + showing.follows, 1)
                self._send_response(200, "text/html; charset=utf-8", live)
            elif self.path == "/state":
                with showing.lock:
                    state = json.dumps(showing.state).encode()
                self._send_response(200, "application/json", state)
            elif self.path == "/events":
                self._events(showing)
            else:
                self._send_response(404, "text/plain", b"there is no such page\n")

    return PageServer(host.strip("[]"), port, Handler)


MAX_CONNECTIONS = 64
"""Largest number of simultaneous connections. A browser opens six to each page, and one for events."""

REQUEST_TIMEOUT = 15.0
"""Time (s) within which a whole request must arrive."""

ANSWER_TIMEOUT = 60.0
"""Time (s) within which a client must receive the whole answer: a page of 10 MB at 1.3 Mbit/s."""

BUSY = b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"

HTTP_PORT = 80
"""Port that browsers omit from the Host header."""


class PageServer(ThreadingHTTPServer):
    """HTTP server with limits on the number and the duration of connections, for requests to this computer's names."""

    daemon_threads = True
    request_queue_size = MAX_CONNECTIONS

    def __init__(self, host: str, port: int, handler: type[_PageHandler]) -> None:
        (self.address_family, _, _, _, address), *_ = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        self._free = threading.BoundedSemaphore(MAX_CONNECTIONS)
        self.deadlines: dict[socket.socket, float] = {}
        super().__init__(cast(tuple[str, int], address), handler)
        self._names = {"127.0.0.1", "::1", "localhost", host.lower()}
        self._is_open = ip_address(str(self.server_address[0])).is_unspecified
        if self._is_open:
            self._names.add(socket.gethostname().lower())

    def server_bind(self) -> None:
        """Bind the socket, without the name look-up of `HTTPServer`, which may take seconds."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = str(self.server_address[0]), self.server_address[1]

    @property
    def url(self) -> str:
        """Address of the page for a browser on this computer."""
        host = str(self.server_address[0])
        if self._is_open:
            host = "::1" if ":" in host else "127.0.0.1"
        return f"http://{f'[{host}]' if ':' in host else host}:{self.server_port}/"

    def is_own_host(self, host: str) -> bool:
        """Whether a Host header contains a name or address of this computer.

        If the server listens on all addresses, each IP address is accepted, because DNS rebinding needs a host name.
        """
        match = re.fullmatch(r"(?:\[([0-9a-f:.]+)\]|([^:\[\]]+))(?::(\d{1,5}))?", host.lower())
        if match is None or int(match[3] or HTTP_PORT) != self.server_port:
            return False
        name = match[1] or match[2]
        if name in self._names or not self._is_open:
            return name in self._names
        try:
            return bool(ip_address(name))
        except ValueError:
            return False

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in its own thread, or refuse it if there are too many connections."""
        if not self._free.acquire(blocking=False):
            with suppress(OSError):
                request.settimeout(0.0)
                request.sendall(BUSY)
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except BaseException:
            self._free.release()
            raise

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a connection until it ends."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.deadlines.pop(request, None)
            self._free.release()

    def service_actions(self) -> None:
        """Close connections whose request has not arrived in time. `serve_forever` calls this twice a second."""
        now = time.monotonic()
        for request, deadline in list(self.deadlines.items()):
            if now > deadline:
                with suppress(OSError):
                    request.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore errors of clients that closed their connection. Report other errors as faults of this server."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class _PageHandler(BaseHTTPRequestHandler):
    """Handler of the requests of one connection."""

    protocol_version = "HTTP/1.1"
    timeout = ANSWER_TIMEOUT
    server: PageServer

    def handle_one_request(self) -> None:
        """Read and answer one request."""
        self.server.deadlines[self.request] = time.monotonic() + REQUEST_TIMEOUT
        super().handle_one_request()

    def _send_response(self, code: int, kind: str, content: bytes) -> None:
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

    def _events(self, showing: PageState) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Connection", "close")
        self._about()
        self.end_headers()
        self.close_connection = True
        for line in showing.listen():
            self.wfile.write(line)
            self.wfile.flush()

    def log_message(self, format: str, *args: object) -> None:
        """Write nothing, because the terminal shows the changes of the spec."""
