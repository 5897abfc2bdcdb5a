"""A twin that follows, as a page for a browser on this computer.

The page requests the view five times a second. Its content security policy forbids it to load anything from elsewhere.
A request that names another host than this one is refused, so that a page of the internet whose name points to this
computer gets nothing. Requests are answered one after another, each within a second, so that no client can take the
descriptors that the recording needs.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from importlib.resources import files
from ipaddress import ip_address
from socket import AF_INET, AF_INET6
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

from heli_identifier.errors import ConfigurationError
from heli_identifier.live.datagrams import read_address
from heli_identifier.live.session import Show, View
from heli_identifier.results import to_json_value

_EVENTS_SHOWN = 50  # the latest ones
_FILES = {
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


class _Server(HTTPServer):
    def __init__(self, address: tuple[str, int], title: str) -> None:
        self.address_family = AF_INET6 if ":" in address[0] else AF_INET
        self.host, self.title, self.view = address[0], title, View()
        super().__init__(address, _Handler)

    def handle_error(self, request: Any, client_address: Any) -> None:
        pass  # a client that leaves is no error


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    server_version, sys_version = "heli", ""
    timeout = 1.0  # [s] for which a connection may say nothing

    def do_GET(self) -> None:
        """Answer with the page, its parts, or the view."""
        path = urlsplit(self.path).path
        if not self._names_this_host():
            self._send(421, "text/plain; charset=utf-8", b"this is not the host that was asked for\n")
        elif path == "/view":
            view = self.server.view
            shown = {"title": self.server.title, "stream": view.stream.line, "events": view.events[-_EVENTS_SHOWN:]}
            self._send(200, "application/json", json.dumps(to_json_value({**view._asdict(), **shown})).encode())
        elif path in _FILES:
            name, kind = _FILES[path]
            self._send(200, kind, (files("heli_identifier.live") / "page" / name).read_bytes())
        else:
            self._send(404, "text/plain; charset=utf-8", b"there is no such page\n")

    def _names_this_host(self) -> bool:
        """Return whether the request names this server's address; any other name was made to point here."""
        try:
            host = urlsplit("//" + self.headers.get("Host", "")).hostname
        except ValueError:
            return False
        return host == self.server.host or (host == "localhost" and ip_address(self.server.host).is_loopback)

    def _send(self, code: int, kind: str, content: bytes) -> None:
        self.send_response(code)
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(content))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        pass  # the terminal shows the twin


@contextmanager
def serve_page(address: str, title: str) -> Iterator[tuple[str, Show]]:
    """Serve the page while the block runs; yield its address and a function that shows a view on it.

    An invalid address, one of many machines, and a port that is taken are a ConfigurationError.
    """
    numeric = read_address(address, "--serve", 0)
    try:
        server = _Server(numeric, title)
    except OSError as error:
        reason = f"{error.strerror}; name an address of this computer and a free port."
        raise ConfigurationError(f"--serve {address} cannot be served: {reason}") from error
    Thread(target=server.serve_forever, kwargs={"poll_interval": 0.2}, daemon=True).start()
    host = f"[{server.host}]" if ":" in server.host else server.host

    def show(view: View) -> None:
        server.view = view

    try:
        yield f"http://{host}:{server.server_address[1]}/", show
    finally:
        server.shutdown()
        server.server_close()
