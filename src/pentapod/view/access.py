"""Access control of the viewer: only the browser that was given its address may connect.

Any web page that is open in the browser can send requests to this machine. So every request is checked first: its Host
must be this machine, its Origin this server, and it must have the token. The token is in the printed address; the page
sends it with each request.
"""

from __future__ import annotations

import ipaddress
import secrets
import socket
from dataclasses import dataclass, field
from email.message import Message
from urllib.parse import parse_qs, urlsplit

LOOPBACK = ("localhost", "127.0.0.1", "::1")

TOKEN_HEADER = "X-Pentapod-Token"


@dataclass(frozen=True)
class Access:
    """Requirements on a request. host: address that the server listens on."""

    host: str
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24), repr=False)

    def refusal(self, path: str, headers: Message) -> str:
        """Return why a request is refused; empty where it is not."""
        hosts, origins = headers.get_all("Host", []), headers.get_all("Origin", [])
        if len(hosts) != 1 or not self._is_here(hosts[0]):
            return "this server has another name"
        if origins and (len(origins) > 1 or not _is_origin_of(origins[0], hosts[0])):
            return "pages of other servers may not connect"
        given = [*_in_address(path), *headers.get_all(TOKEN_HEADER, [])]
        if not any(secrets.compare_digest(each.encode(), self.token.encode()) for each in given):
            return "open the address that pentapod view prints, with its token"
        return ""

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


def _in_address(path: str) -> list[str]:
    try:
        return parse_qs(urlsplit(path).query).get("token", [])
    except ValueError:
        return []


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
