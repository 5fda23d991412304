"""Access control of the viewer: only the browser that was given its address may connect.

Any web page that is open in the browser can send requests to this machine. So every request, also for a web socket, is
checked first: its Host must be this machine, its Origin this server, and it must have the token. The token is in the
printed address; a page that was opened by it keeps the token as a cookie.
"""

from __future__ import annotations

import io
import ipaddress
import secrets
import socket
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from pentapod.base.display import load_extra
from pentapod.base.errors import InputError

if TYPE_CHECKING:
    import viser
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

TESTED = "1.1.1"
"""The version of viser that was tested: it has no public way to check requests."""

LOOPBACK = ("localhost", "127.0.0.1", "::1")


def load_viser() -> Any:
    """Return the module viser. Raises InputError where it is not installed, or not as tested."""
    viser = load_extra("viser", "view", "the viewer needs viser", key="viser")
    if viser.__version__ != TESTED:
        raise InputError(
            "with another version of viser, other web pages may be able to connect to the viewer", key="viser",
            value=viser.__version__, expected=TESTED, remedy=f'pip install "viser=={TESTED}"',
        )  # fmt: skip
    return viser


@dataclass(frozen=True)
class Access:
    """Requirements on a request. host: address that the server listens on. cookie: name of the one with the token."""

    host: str
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24), repr=False)
    cookie: str = field(default_factory=lambda: f"pentapod_{secrets.token_hex(4)}")

    def refusal(self, request: Request) -> str:
        """Return why a request is refused; empty where it is not."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or not self._is_here(hosts[0]):
            return "this server has another name"
        if origins and (len(origins) > 1 or not _is_origin_of(origins[0], hosts[0])):
            return "pages of other servers may not connect"
        if not any(secrets.compare_digest(given.encode(), self.token.encode()) for given in self._tokens(request)):
            return "open the address that pentapod view prints, with its token"
        return ""

    def shows_token(self, request: Request) -> bool:
        """Whether the token is in the address."""
        return self.token in _in_address(request)

    @property
    def kept(self) -> str:
        """The cookie with the token: for this server alone, and for no request that another page makes."""
        return f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def _tokens(self, request: Request) -> list[str]:
        found = _in_address(request)
        for line in request.headers.get_all("Cookie"):
            try:
                jar = SimpleCookie(line)
            except CookieError:
                continue
            found += [jar[self.cookie].value] if self.cookie in jar else []
        return found

    def _is_here(self, host: str) -> bool:
        """Whether a Host header names this machine. Names that others point to it do not count."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if name in (*LOOPBACK, self.host.lower()):
            return True
        if self.host in LOOPBACK:
            return False
        own = socket.gethostname().lower()
        return _is_address(name) or name in (own, f"{own}.local")


def open_server(access: Access, port: int) -> viser.ViserServer:
    """Return a server that checks every request and opens no tunnel. Raises InputError where that fails."""
    viser = load_viser()
    from websockets.asyncio import server as sockets  # noqa: PLC0415 - comes with viser

    class Server(viser.ViserServer):
        def request_share_url(self, verbose: bool = True) -> str | None:
            """Open no tunnel, which would make the run public."""
            del verbose

    plain, guards = sockets.serve, list[str]()

    def serve(*given: Any, process_request: Any, **named: Any) -> Any:
        guards.append("set")

        def first(connection: ServerConnection, request: Request) -> Response | None:
            if refused := access.refusal(request):
                return connection.respond(HTTPStatus.FORBIDDEN, refused + "\n")
            answer: Response | None = process_request(connection, request)
            if answer is not None and access.shows_token(request):
                answer.headers["Set-Cookie"] = access.kept
            return answer

        return plain(*given, process_request=first, **named)

    # viser has no option for such a function, and starts to listen within its constructor.
    sockets.serve = serve
    try:
        with redirect_stdout(io.StringIO()):  # it prints even without verbose
            server = Server(host=access.host, port=port, verbose=False)
    finally:
        sockets.serve = plain
    if not guards:
        server.stop()
        raise InputError(
            "this version of viser would let every web page connect", key="viser", expected=f"viser {TESTED}"
        )
    server.gui.configure_theme(show_share_button=False)
    return server


def _in_address(request: Request) -> list[str]:
    return parse_qs(urlsplit(request.path).query).get("token", [])


def _is_origin_of(origin: str, host: str) -> bool:
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc.lower() == host.lower()


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
