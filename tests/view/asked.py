"""Requests to the viewer's server, as its page makes them."""

from __future__ import annotations

import http.client
import json
import time
from contextlib import closing
from urllib.parse import parse_qs, urlsplit

from pentapod.geometry import RigidTransform
from pentapod.view.access import TOKEN_HEADER
from pentapod.view.viewed import numbers_of

PATIENCE_S = 240.0


def address(viewer):
    """Host with port, and token."""
    parts = urlsplit(viewer.url)
    return parts.netloc, parse_qs(parts.query)["token"][0]


def page_of(viewer, path="/"):
    """The text of a page, and its headers."""
    here, token = address(viewer)
    with closing(http.client.HTTPConnection(here, timeout=PATIENCE_S)) as connection:
        connection.request("GET", f"{path}?token={token}")
        answer = connection.getresponse()
        assert answer.status == 200
        return answer.read().decode("utf-8"), answer.headers


def ask(viewer, name, content=None, *, number=1, expected=200, connection=None):
    """What the server answers to a request of its page."""
    here, token = address(viewer)
    if connection is None:
        with closing(http.client.HTTPConnection(here, timeout=PATIENCE_S)) as own:
            return ask(viewer, name, content, number=number, expected=expected, connection=own)
    body = content if isinstance(content, bytes) else json.dumps({} if content is None else content)
    connection.request("POST", f"/{number}/{name}", body, {TOKEN_HEADER: token})
    answer = connection.getresponse()
    said = json.loads(answer.read())
    assert answer.status == expected, said
    return said


def at(placement, **more):
    """A request about a placement."""
    return {"placement": numbers_of(placement), **more}


def shifted(placement, *shift):
    """A placement moved in the machine's frame, metres."""
    return RigidTransform(placement.rotation, placement.translation + shift)


def planned_there(viewer, placement):
    """Plan again with the part at a placement; return what is said at the end, and the stages that were told."""
    state, stages = ask(viewer, "plan", at(placement)), []
    end = time.monotonic() + PATIENCE_S
    while state["plans"]:
        stages.append((state["stage"], state["share"]))
        assert time.monotonic() < end, "it did not end"
        time.sleep(0.02)
        state = ask(viewer, "state")
    return state["news"], stages
