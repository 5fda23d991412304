"""The viewer's access: raw clients with foreign Origin, foreign Host or no token get nothing and change nothing."""

from __future__ import annotations

import shutil
import socket
import time
import urllib.error
import urllib.request

import pytest

from pentapod.base.errors import InputError
from pentapod.view import Viewer, open_run
from pentapod.view.access import Access, load_viser, open_server

viser = pytest.importorskip("viser", reason="viser is not installed")
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
FOREIGN = "https://evil.example"


@pytest.fixture(scope="module")
def viewer(planned, tmp_path_factory):
    folder = tmp_path_factory.mktemp("access")
    shutil.copytree(planned[0], folder / "job")
    with Viewer(open_run(folder / "job" / "out"), port=18300) as viewer:
        yield viewer


def address(viewer):
    """Host with port, and token."""
    base, _, token = viewer.url.partition("/?token=")
    return base.removeprefix("http://"), token


def handshake(viewer, *, query="", host=None, headers=()):
    """The status of a web socket's handshake over a bare connection, and all that came within half a second."""
    here, _ = address(viewer)
    name, port = here.split(":")
    lines = [
        f"GET /{query} HTTP/1.1", f"Host: {host or here}", "Upgrade: websocket", "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: viser-v{viser.__version__}", *headers,
    ]  # fmt: skip
    with socket.create_connection((name, int(port)), timeout=30.0) as connection:
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        said = connection.recv(65536)
        connection.settimeout(0.5)
        try:
            while more := connection.recv(65536):
                said += more
        except TimeoutError:
            pass
    return int(said.split()[1]), said


def refused(viewer, **given):
    status, said = handshake(viewer, **given)
    return status == 403 and b"/part" not in said and len(said) < 1000


def test_who_has_the_address_gets_the_scene(viewer):
    here, token = address(viewer)
    for headers in ((), (f"Origin: http://{here}",)):
        status, said = handshake(viewer, query=f"?token={token}", headers=headers)
        assert status == 101
        assert len(said) > 10_000
    port = here.split(":")[1]
    assert handshake(viewer, query=f"?token={token}", host=f"localhost:{port}")[0] == 101


@pytest.mark.parametrize("origin", [FOREIGN, "null", "http://127.0.0.1:1", "http://127.0.0.1.evil.example:18300", "file://",
                                    "http://[::1", ""])  # fmt: skip
def test_foreign_origins_get_nothing_even_with_the_token(viewer, origin):
    _, token = address(viewer)
    assert refused(viewer, query=f"?token={token}", headers=[f"Origin: {origin}"])


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:18300", "127.0.0.1.evil.example", "10.1.2.3:18300", "[", "a@b"]
)
def test_foreign_hosts_get_nothing_even_with_the_token(viewer, host):
    """A name that somebody points here (DNS rebinding): then Origin and Host agree."""
    _, token = address(viewer)
    assert refused(viewer, query=f"?token={token}", host=host, headers=[f"Origin: http://{host}"])
    assert refused(viewer, query=f"?token={token}", host=host)


def test_two_hosts_or_origins_are_none(viewer):
    here, token = address(viewer)
    assert handshake(viewer, query=f"?token={token}", headers=["Host: evil.example"])[0] != 101
    own = f"Origin: http://{here}"
    assert refused(viewer, query=f"?token={token}", headers=[own, f"Origin: {FOREIGN}"])


@pytest.mark.parametrize("query", ["", "?token=", "?token=wrong", "?token=%C3%A9", "?Token={token}", "?token={token}x"])
def test_without_the_token_nothing_is_sent_and_nothing_can_be_written(viewer, query):
    here, token = address(viewer)
    query = query.replace("{token}", token)
    assert refused(viewer, query=query)
    assert refused(viewer, query=query, headers=[f"Origin: http://{here}"])
    assert refused(viewer, query=query, headers=["Cookie: pentapod=" + token])
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(f"http://{here}/{query}", timeout=30.0)


def test_the_page_keeps_the_token_for_its_own_socket(viewer):
    here, token = address(viewer)
    with urllib.request.urlopen(viewer.url, timeout=30.0) as page:
        cookie = page.headers["Set-Cookie"]
    assert "SameSite=Strict" in cookie
    assert "HttpOnly" in cookie
    kept = cookie.split(";")[0]
    assert token in kept
    assert handshake(viewer, headers=[f"Cookie: other=1; {kept}", f"Origin: http://{here}"])[0] == 101
    assert refused(viewer, headers=[f"Cookie: {kept}", f"Origin: {FOREIGN}"])
    request = urllib.request.Request(f"http://{here}/", headers={"Cookie": kept})
    with urllib.request.urlopen(request, timeout=30.0) as page:
        assert page.headers["Set-Cookie"] is None


def test_no_tunnel_is_opened(viewer, monkeypatch):
    """Not even for a client that was answered."""
    import msgspec
    from viser import _tunnel
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    opened = []
    monkeypatch.setattr(_tunnel.ViserTunnel, "__init__", lambda *_, **__: opened.append("tunnel"))
    protocols = [Subprotocol(f"viser-v{viser.__version__}")]
    with connect(viewer.url.replace("http", "ws"), subprotocols=protocols, max_size=None) as client:
        client.recv(timeout=30.0)
        client.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        time.sleep(0.5)
    assert opened == []
    assert viewer._server.request_share_url() is None


def test_listening_to_all_lets_addresses_in_but_no_names():
    from websockets.datastructures import Headers
    from websockets.http11 import Request

    access = Access("0.0.0.0")

    def answer(host):
        return access.refusal(Request(f"/?token={access.token}", Headers(Host=host)))

    assert {answer(host) for host in ("10.1.2.3:8080", "[fe80::1]:8080", "localhost:8080", socket.gethostname())} == {
        ""
    }
    assert all(answer(host) for host in ("evil.example", "10.1.2.3.evil.example:8080"))
    assert access.token not in repr(access)


def test_another_version_of_viser_is_refused(monkeypatch):
    monkeypatch.setattr(viser, "__version__", "1.2.0")
    with pytest.raises(InputError, match=r"viser: .*other web pages.*1\.2\.0.*pip install \"viser==1\.1\.1\""):
        load_viser()


def test_a_server_that_cannot_be_guarded_is_not_opened(monkeypatch):
    stopped = []

    class Unguarded:
        def __init__(self, **_):
            pass

        def stop(self):
            stopped.append(self)

    monkeypatch.setattr(viser, "ViserServer", Unguarded)
    with pytest.raises(InputError, match="let every web page connect"):
        open_server(Access("127.0.0.1"), 18390)
    assert stopped
