"""Viewer: server of the live page: the standard library's, with answers to what the page asks."""

from __future__ import annotations

import errno
import json
import os
import threading
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socket import SHUT_RDWR, socket
from socketserver import TCPServer
from types import TracebackType
from typing import Any, cast
from urllib.parse import urlsplit

from pentapod.base.errors import InputError, PentapodError
from pentapod.view.access import Access
from pentapod.view.compare import compare_page
from pentapod.view.opened_run import OpenedRun
from pentapod.view.served import ServedRun, read_json

MOST_BYTES = 1 << 20
"""Of what a request brings along: a placement file at most."""

PORTS = 100
"""How many ports are tried, from the first one on."""

HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # the address has the token
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Content-Security-Policy": "frame-ancestors 'self'",
}
"""Of each answer, beside the page's own Content-Security-Policy."""


class Viewer:
    """A server that shows one run, or two side by side, until it is stopped. Also a context manager.

    host, port: address; the next free port where that one is in use. Only requests with the token in `url` are answered
    (`access`). Raises InputError where a file of a run is broken, or the address cannot be listened on.
    """

    def __init__(
        self, run: OpenedRun, other: OpenedRun | None = None, *, host: str = "127.0.0.1", port: int = 8080
    ) -> None:
        self._access = Access(host)
        self._server = _server(self._access, port)
        try:
            for number, each in enumerate((run,) if other is None else (run, other), start=1):
                self._server.runs[f"{number}"] = ServedRun(each, self._access.token, f"/{number}")
        except BaseException:
            self._server.server_close()
            raise
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """The address for the browser, with the token."""
        host = f"[{self._access.host}]" if ":" in self._access.host else self._access.host
        return f"http://{host}:{self._server.server_port}/?token={self._access.token}"

    @property
    def runs(self) -> tuple[ServedRun, ...]:
        """The runs that are shown."""
        return tuple(self._server.runs.values())

    def stop(self) -> None:
        """End the server, and a plan that is being made."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
        for run in self.runs:
            run.stop()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def _server(access: Access, port: int) -> _Server:
    """Return a server on the first free port. Raises InputError where there is none."""
    for tried in range(port, min(port + PORTS, 65536)):
        try:
            return _Server(access, tried)
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                what = f"cannot listen there: {(error.strerror or str(error)).lower()}"
                raise InputError(what, key="host", value=access.host, expected="an address of this machine") from error
    raise InputError("no free port", key="port", value=port, remedy="name another with --port")


class _Server(ThreadingHTTPServer):
    """Has the runs by the first part of their paths."""

    daemon_threads = True
    allow_reuse_address = os.name != "nt"  # there it would share a port that is in use

    def __init__(self, access: Access, port: int) -> None:
        self.access = access
        self.runs: dict[str, ServedRun] = {}
        self._connections: set[socket] = set()
        super().__init__((access.host, port), _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Keep the connection, to end it with the server."""
        self._connections.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """End a connection."""
        self._connections.discard(request)
        super().shutdown_request(request)

    def server_close(self) -> None:
        """End all connections: browsers keep them."""
        super().server_close()
        for connection in tuple(self._connections):
            with suppress(OSError):
                connection.shutdown(SHUT_RDWR)

    def server_bind(self) -> None:
        """Bind without asking for the name of the address, which may take long."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = str(self.server_address[0]), int(self.server_address[1])


class _Handler(BaseHTTPRequestHandler):
    """Pages by GET, answers in JSON by POST."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    timeout = 600

    @property
    def _own(self) -> _Server:
        return cast("_Server", self.server)

    def do_GET(self) -> None:
        """Send a page: of the only run, of both, or of one of them."""
        if self._is_refused():
            return
        runs, name = self._own.runs, urlsplit(self.path).path.strip("/")
        if not name and len(runs) > 1:
            page = compare_page([run.viewed for run in runs.values()], self._own.access.token).encode()
        elif (run := runs.get(name or "1")) is not None:
            page = run.page
        else:
            self._send(HTTPStatus.NOT_FOUND, b"there is no such page\n")
            return
        self._send(HTTPStatus.OK, page, "text/html; charset=utf-8")

    def do_POST(self) -> None:
        """Answer what a page asks."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MOST_BYTES:
            self.close_connection = True
            self._send(HTTPStatus.BAD_REQUEST, b"a request of this length is not answered\n")
            return
        body = self.rfile.read(int(length))
        if self._is_refused():
            return
        number, _, name = urlsplit(self.path).path.strip("/").partition("/")
        run, answer, status = self._own.runs.get(number), None, HTTPStatus.OK
        try:
            answer = None if run is None else run.answer(name, read_json(body))
        except PentapodError as error:
            answer, status = {"error": str(error)}, HTTPStatus.BAD_REQUEST
        if answer is None:
            answer, status = {"error": "there is no such answer"}, HTTPStatus.NOT_FOUND
        self._send(status, json.dumps(answer, allow_nan=False, separators=(",", ":")).encode(), "application/json")

    def _is_refused(self) -> bool:
        """Whether a request may not be answered; that is sent."""
        refused = self._own.access.refusal(self.path, self.headers)
        if refused:
            self.close_connection = True
            self._send(HTTPStatus.FORBIDDEN, f"{refused}\n".encode())
        return bool(refused)

    def _send(self, status: HTTPStatus, body: bytes, kind: str = "text/plain; charset=utf-8") -> None:
        self.send_response(status)
        for name, value in {**HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of requests: their addresses have the token."""
