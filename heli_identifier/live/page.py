"""A twin that follows, as a page for a browser on this computer.

The page, its script and its style come from here, and views follow as server-sent events. The page may load nothing
from anywhere else (its content security policy says so). A request that names another host than this one is refused: a
page of the internet that lets its name point to this computer gets nothing. Connections beyond MOST_CONNECTIONS are
closed at once, so that none can take the descriptors that the recording needs.
"""

import json
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from ipaddress import ip_address
from socket import AF_INET6, AddressFamily
from threading import BoundedSemaphore, Condition, Thread
from typing import Any
from urllib.parse import urlsplit

from heli_identifier.errors import ConfigurationError
from heli_identifier.live.datagrams import is_every
from heli_identifier.live.listening import Status
from heli_identifier.live.screen import stream_line
from heli_identifier.live.session import View
from heli_identifier.live.sources import find_address
from heli_identifier.results import plain

PAST = 300
"""Instants that a page receives when it is opened: a minute of flight, five predictions a second."""

MOST_CONNECTIONS = 32

_WAIT = 5.0  # [s] after which a comment shows that the connection lives
_PAGES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/follow.js": ("follow.js", "text/javascript; charset=utf-8"),
    "/follow.css": ("follow.css", "text/css; charset=utf-8"),
}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Board:
    """The latest view, what fell due of late, and the sentence with which the flight ended."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.past: deque[Any] = deque(maxlen=PAST)
        self.passed = 0  # instants that ever fell due
        self.latest: dict[str, Any] = {"view": None, "line": ""}
        self.number, self.over = 0, ""
        self.changed = Condition()

    def show(self, view: View | None, status: Status | None) -> None:
        """Put up a view."""
        document = plain(view)
        due = document.pop("due") if document else []
        with self.changed:
            self.past.extend(due)
            self.passed += len(due)
            self.latest = {"view": document, "line": stream_line(status) if status else ""}
            self.number += 1
            self.changed.notify_all()

    def end(self, sentence: str) -> None:
        """Tell the readers that nothing more comes."""
        with self.changed:
            self.over = sentence
            self.changed.notify_all()

    def messages(self) -> Iterator[bytes]:
        """Give server-sent events; an empty comment while nothing happens."""
        yield _message("title", self.title)
        seen, passed, over = -1, 0, ""
        while not over:
            with self.changed:
                if self.number == seen and not self.over:
                    self.changed.wait(_WAIT)
                new = list(self.past)[-(self.passed - passed) :] if self.passed > passed else []
                told = {**self.latest, "due": new} if self.number != seen else None
                seen, passed, over = self.number, self.passed, self.over
            yield _message("view", told) if told else b":\n\n"
        yield _message("end", over)


def _message(name: str, data: Any) -> bytes:
    return f"event: {name}\ndata: {json.dumps(data)}\n\n".encode()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128  # of connections that come at once; one that finds no place comes again after a second

    def __init__(self, family: AddressFamily, place: tuple[str, int], board: Board) -> None:
        self.address_family, self.host, self.board = family, place[0], board
        self.free = BoundedSemaphore(MOST_CONNECTIONS)
        super().__init__(place, _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if self.free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        pass  # a reader that leaves is no error


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    server_version, sys_version = "heli", ""
    timeout = 30.0

    def do_GET(self) -> None:
        """Answer with the page, its parts or the events."""
        if not self._is_for_us():
            self._send(421, "text/plain; charset=utf-8", b"this is not the host that was asked for\n")
        elif self.path == "/events":
            self._start(200, {"Content-Type": "text/event-stream"})
            for message in self.server.board.messages():
                self.wfile.write(message)
                self.wfile.flush()
        elif self.path in _PAGES:
            name, kind = _PAGES[self.path]
            self._send(200, kind, (files("heli_identifier.live") / "page" / name).read_bytes())
        else:
            self._send(404, "text/plain; charset=utf-8", b"there is no such page\n")

    def _is_for_us(self) -> bool:
        """Whether the request names an address of this server: a foreign name was made to point here."""
        try:
            host = urlsplit("//" + self.headers.get("Host", "")).hostname
        except ValueError:
            return False
        return host == self.server.host or (host == "localhost" and ip_address(self.server.host).is_loopback)

    def _send(self, code: int, kind: str, content: bytes) -> None:
        self._start(code, {"Content-Type": kind, "Content-Length": str(len(content))})
        self.wfile.write(content)

    def _start(self, code: int, headers: dict[str, str]) -> None:
        self.send_response(code)
        for name, value in {**_HEADERS, **headers}.items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        pass  # the terminal shows the twin


@contextmanager
def served(address: str, title: str) -> Iterator[tuple[str, Board]]:
    """Serve the page while the block runs; give its address and the board that views are shown on.

    An address that is none or stands for all, and a port that is taken, are a ConfigurationError.
    """
    family, place = find_address(address, "--serve-at", 0)
    if is_every(place[0]):
        raise ConfigurationError(f"--serve-at {address} would show it to every network; name one address.")
    board = Board(title)
    try:
        server = _Server(family, place, board)
    except OSError as error:
        raise ConfigurationError(f"--serve-at {address} cannot be served: {error.strerror}.") from error
    Thread(target=server.serve_forever, kwargs={"poll_interval": 0.2}, daemon=True).start()
    host = f"[{place[0]}]" if family == AF_INET6 else place[0]
    try:
        yield f"http://{host}:{server.server_address[1]}/", board
    finally:
        board.end(board.over or "the flight has ended; its last minute stays here until this page is closed")
        server.shutdown()
        server.server_close()
