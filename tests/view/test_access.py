"""The viewer's access: raw clients with foreign Origin, foreign Host or no token get nothing and change nothing."""

from __future__ import annotations

import re
import socket
from email.message import Message

import pytest
from asked import address, ask, at, page_of

from pentapod.view import Viewer
from pentapod.view.access import TOKEN_HEADER, Access

FOREIGN = "https://evil.example"


@pytest.fixture(scope="module")
def viewer(opened):
    with Viewer(opened, port=18300) as viewer:
        yield viewer


def sent(viewer, first, *headers, host=None, body=b""):
    """The status of an answer over a bare connection, and all of it."""
    here, _ = address(viewer)
    name, port = here.split(":")
    lines = [first, *([] if host == "" else [f"Host: {host or here}"]), "Connection: close", *headers]
    with socket.create_connection((name, int(port)), timeout=30.0) as connection:
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode("latin-1") + body)
        said = b""
        while more := connection.recv(65536):
            said += more
    return int(said.split()[1]), said


def got(viewer, query="", *headers, host=None):
    return sent(viewer, f"GET /{query} HTTP/1.1", *headers, host=host)


def posted(viewer, *headers, host=None):
    """A plan is asked for, which writes files."""
    body = b'{"placement": [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]}'
    return sent(viewer, "POST /1/plan HTTP/1.1", f"Content-Length: {len(body)}", *headers, host=host, body=body)


def refused(viewer, query="", *headers, host=None):
    """Whether neither the page nor an answer is given."""
    token = query.removeprefix("?token=")
    for status, said in (
        got(viewer, query, *headers, host=host),
        posted(viewer, f"{TOKEN_HEADER}: {token}", *headers, host=host),
    ):
        if status != 403 or b"placement" in said or len(said) > 1000:
            return False
    return not ask(viewer, "state")["plans"]


def test_who_has_the_address_gets_the_page(viewer):
    here, token = address(viewer)
    for headers in ((), (f"Origin: http://{here}",)):
        status, said = got(viewer, f"?token={token}", *headers)
        assert status == 200
        assert len(said) > 100_000
    assert got(viewer, f"?token={token}", host=f"localhost:{here.split(':')[1]}")[0] == 200


@pytest.mark.parametrize("origin", [FOREIGN, "null", "http://127.0.0.1:1", "http://127.0.0.1.evil.example:18300", "file://",
                                    "http://[::1", ""])  # fmt: skip
def test_foreign_origins_get_nothing_even_with_the_token(viewer, origin):
    _, token = address(viewer)
    assert refused(viewer, f"?token={token}", f"Origin: {origin}")


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:18300", "127.0.0.1.evil.example", "10.1.2.3:18300", "[", "a@b"]
)
def test_foreign_hosts_get_nothing_even_with_the_token(viewer, host):
    """A name that somebody points here (DNS rebinding): then Origin and Host agree."""
    _, token = address(viewer)
    assert refused(viewer, f"?token={token}", f"Origin: http://{host}", host=host)
    assert refused(viewer, f"?token={token}", host=host)


def test_two_hosts_or_origins_are_none(viewer):
    here, token = address(viewer)
    assert refused(viewer, f"?token={token}", "Host: evil.example")
    assert refused(viewer, f"?token={token}", f"Origin: http://{here}", f"Origin: {FOREIGN}")
    assert refused(viewer, f"?token={token}", host="")


@pytest.mark.parametrize(
    "query", ["", "?token=", "?token=wrong", "?token=\xe9", "?Token={token}", "?token={token}x", "?token=//[{token}"]
)
def test_without_the_token_nothing_is_sent_and_nothing_can_be_written(viewer, query):
    here, token = address(viewer)
    query = query.replace("{token}", token)
    assert got(viewer, query)[0] == 403
    assert refused(viewer, query.replace("?Token=" + token, "?token=no"))
    assert got(viewer, query, f"Origin: http://{here}", f"Cookie: token={token}")[0] == 403


def test_the_page_may_ask_its_own_server_alone(viewer):
    text, headers = page_of(viewer)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1].replace("&#39;", "'")
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["connect-src"] == rules["frame-src"] == "'self'"
    assert rules["script-src"].startswith("'sha256-")
    assert headers["Content-Security-Policy"] == "frame-ancestors 'self'"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    assert "Set-Cookie" not in headers
    assert "Access-Control-Allow-Origin" not in headers


def test_what_is_no_question_is_an_error(viewer, opened):
    _, token = address(viewer)
    own = f"{TOKEN_HEADER}: {token}"
    for length in ("x", "-1", "99999999999", "1e3"):
        assert sent(viewer, "POST /1/margins HTTP/1.1", own, f"Content-Length: {length}")[0] == 400
    assert sent(viewer, "POST /1/margins HTTP/1.1", own)[0] == 400
    assert "not JSON" in ask(viewer, "margins", b"{", expected=400)["error"]
    assert "not JSON" in ask(viewer, "margins", [1], expected=400)["error"]
    far = at(opened.placement)["placement"]
    for wrong in ([], far[:11], [*far, 0.0], [2.0 * v for v in far], ["x"] * 12, [[1.0] * 12] * 9, [float("nan")] * 12):
        assert "not a placement" in ask(viewer, "margins", {"placement": wrong}, expected=400)["error"]
    assert "not a placement" in ask(viewer, "plan", {}, expected=400)["error"]
    ask(viewer, "nothing", {}, expected=404)
    ask(viewer, "margins", at(opened.placement), number=2, expected=404)
    assert got(viewer, f"nothing?token={token}")[0] == 404
    assert got(viewer, f"../../etc/passwd?token={token}")[0] == 404
    assert sent(viewer, f"PUT /?token={token} HTTP/1.1")[0] == 501


def test_listening_to_all_lets_addresses_in_but_no_names():
    access = Access("0.0.0.0")

    def answer(host):
        headers = Message()
        headers["Host"] = host
        return access.refusal(f"/?token={access.token}", headers)

    assert {answer(host) for host in ("10.1.2.3:8080", "[fe80::1]:8080", "localhost:8080", socket.gethostname())} == {
        ""
    }
    assert all(answer(host) for host in ("evil.example", "10.1.2.3.evil.example:8080"))
    assert access.token not in repr(access)
