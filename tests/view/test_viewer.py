"""The server: a client connects, drags the part, scrubs and plans anew; a browser draws it.

PENTAPOD_SHOTS names a folder for a picture.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from pentapod.cli.main import run
from pentapod.geometry import RigidTransform
from pentapod.job import Job
from pentapod.view import Viewer, open_run
from pentapod.view.shapes import quaternion, rotation_of

viser = pytest.importorskip("viser", reason="viser is not installed")
CHROMIUM = os.environ.get("PENTAPOD_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE_S = 120.0
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture
def viewer(planned, tmp_path):
    shutil.copytree(planned[0], tmp_path / "job")
    with Viewer(open_run(tmp_path / "job" / "out"), port=18100) as viewer:
        yield viewer


class Client:
    """What a browser is to the server: it sends what was dragged, and reads what is to be drawn."""

    def __init__(self, viewer):
        from websockets.sync.client import connect
        from websockets.typing import Subprotocol

        address = viewer.url.replace("http", "ws")
        self.socket = connect(address, subprotocols=[Subprotocol(f"viser-v{viser.__version__}")], max_size=None)

    def send(self, kind, **content):
        import msgspec

        self.socket.send(msgspec.msgpack.encode({"type": kind, **content}))

    def messages(self):
        """Messages as they come, until the server has been silent for a while."""
        import msgspec
        import zstandard

        while True:
            frame = self.socket.recv(timeout=PATIENCE_S)
            size = int.from_bytes(frame[8:16], "little")
            content = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size]))
            yield from content["messages"]

    def until(self, wanted):
        """The first message that is wanted."""
        return next(message for message in self.messages() if wanted(message))


def shifted(placement, *shift):
    return RigidTransform(placement.rotation, placement.translation + np.array(shift))


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.02)


def test_viewer_margins_follow_the_dragged_part(viewer):
    before, start = viewer.reach, viewer.placement
    assert before.fits
    assert "**Fits.**" in viewer.panel.reach.content
    client = Client(viewer)
    drawn = {m["name"] for m in _until_replayed(client) if m["type"].endswith("Message") and "name" in m}
    assert {"/part", "/part/mesh", "/part/path", "/tool", "/legs/1", "/legs/5"} <= drawn
    handle = viewer._scene.part
    held = np.asarray(handle.position, dtype=np.float64).tolist()
    client.send("TransformControlsDragStartMessage", name="/part", owner="")
    for metres in (0.1, 0.3, 0.5):  # quicker than they can be judged
        position = (held[0] + metres, held[1], held[2])
        turn = tuple(np.asarray(handle.wxyz, dtype=np.float64).tolist())
        client.send("TransformControlsUpdateMessage", name="/part", owner="", wxyz=turn, position=position)
    client.send("TransformControlsDragEndMessage", name="/part", owner="")
    moved = client.until(
        lambda m: m["type"] == "SceneNodeUpdateMessage" and m["name"] == "/part/path" and "colors" in m["updates"]
    )
    assert moved["updates"]["colors"]
    wait_for(lambda: np.linalg.norm(viewer.placement.translation - start.translation - [0.5, 0.0, 0.0]) < 1e-6)
    wait_for(lambda: not viewer.reach.fits and len(viewer.reach.rows) == len(viewer.run.toolpath))
    assert viewer.reach.worst.margin < before.worst.margin
    wait_for(lambda: "**Does not fit**" in viewer.panel.reach.content)
    assert viewer.reach.worst.limit in viewer.panel.reach.content
    client.socket.close()


def _until_replayed(client):
    found = []
    for message in client.messages():
        if message["type"] == "ReplayDoneMessage":
            return found
        found.append(message)
    return found


def test_viewer_turns_the_part_about_its_middle(viewer):
    start = viewer.placement
    middle = viewer.run.mesh.bounds.mean(axis=0)
    turn = rotation_of(np.array([np.cos(0.2), 0.0, 0.0, np.sin(0.2)]))
    viewer._scene.part.wxyz = quaternion(turn @ start.rotation)
    turned = viewer.placement
    assert turned.rotation == pytest.approx(turn @ start.rotation, abs=1e-9)
    assert turned.apply(middle) == pytest.approx(start.apply(middle), abs=1e-9)


def test_the_slider_moves_legs_and_tool(viewer):
    program = viewer.run.program
    lengths = []
    for row in (0, len(program.legs) // 2):
        viewer.panel.time.value = float(program.times[row])
        legs = [float(np.asarray(leg.scale)[2]) for leg in viewer._scene._legs]
        # The slider has its own steps.
        assert legs == pytest.approx(program.legs[row], abs=2e-4)
        lengths.append(legs)
        tip = np.asarray(viewer._scene._tool.position)
        position, direction = viewer.run.machine.robot.pose(program.legs[row], program.component)
        assert tip == pytest.approx(position + viewer.run.machine.tool_length * direction, abs=2e-4)
    assert np.abs(np.subtract(*lengths)).max() > 1e-3


def test_viewer_plays_the_motion(viewer):
    viewer.panel.speed.value = "4 ×"
    viewer.panel.play.value = True
    wait_for(lambda: viewer.panel.time.value > 0.3)
    viewer.panel.play.value = False
    stopped = viewer.panel.time.value
    time.sleep(0.2)
    assert viewer.panel.time.value == pytest.approx(stopped, abs=0.2)


def test_viewer_plans_again_at_the_dragged_placement(viewer):
    start = viewer.placement
    viewer.move(shifted(start, 0.012, -0.007, 0.004))
    wanted = viewer.placement
    viewer.plan_here()
    done = viewer.replanned
    assert done.outcome.passed
    assert viewer.run is done.run
    assert viewer.placement.translation == pytest.approx(wanted.translation, abs=1e-8)
    assert "Verdict: passed" in viewer.panel.news.content
    # With the table that is shown the job is the program's job.
    job = viewer.run.job.path
    text = job.read_text(encoding="utf-8")
    job.write_text(text.split("[placement]")[0] + done.table + "\n", encoding="utf-8")
    assert run(["verify", str(done.folder / "program.csv"), "--job", str(job), "--quiet"]) == 0
    assert Job.load(job).digest == viewer.run.program.provenance.job_digest


def test_viewer_shows_a_refusal(viewer):
    start = viewer.placement
    viewer.move(shifted(start, 1.0, 0.0, 0.0))
    before = viewer.run
    viewer.plan_here()
    assert viewer.replanned.run is None
    assert viewer.run is before
    assert "**Refused**" in viewer.panel.news.content
    assert not viewer.panel.replan.disabled


def test_without_viser_the_extra_is_named(planned, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert run(["view", str(planned[0] / "out"), "--no-open"]) == 2
    said = capsys.readouterr().err
    assert 'pip install "pentapod[view]"' in said
    assert said.count("\n") == 1


def test_the_command_serves_until_it_is_interrupted(planned):
    command = "from pentapod.cli.main import main; main()"
    arguments = ["view", str(planned[0] / "out"), "--no-open", "--json", "--port", "18200"]
    with subprocess.Popen([sys.executable, "-c", command, *arguments], stdout=subprocess.PIPE, text=True) as serving:
        try:
            said = ""
            while "}" not in said:
                line = serving.stdout.readline()
                assert line, "it ended by itself"
                said += line
            with urllib.request.urlopen(json.loads(said)["url"], timeout=PATIENCE_S) as page:
                assert page.status == 200
                assert b"<canvas" in (content := page.read()) or b"<div" in content
            serving.send_signal(signal.SIGINT)
            assert serving.wait(PATIENCE_S) == 0
        finally:
            serving.kill()


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium; PENTAPOD_CHROMIUM may name one")
def test_viewer_is_drawn_in_a_browser(viewer):
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    from matplotlib.image import imread

    said = []
    with playwright.sync_playwright() as start:
        browser = start.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        page = browser.new_page(viewport={"width": 960, "height": 600})
        page.set_default_timeout(1e3 * PATIENCE_S)
        page.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: said.append(str(error)))

        def picture():
            return (imread(io.BytesIO(page.screenshot()))[100:, 50:600, :3] * 255).astype(np.int16)

        def settled():
            """A picture in which something is drawn and that stays as it is."""
            end = time.monotonic() + PATIENCE_S
            last = picture()
            while time.monotonic() < end:
                page.wait_for_timeout(400)
                here = picture()
                if (here.min(axis=2) < 100).sum() > 1000 and np.abs(here - last).max() < 8:
                    return here
                last = here
            raise AssertionError("nothing was drawn")

        page.goto(viewer.url)
        page.wait_for_selector("canvas")
        page.wait_for_selector("text=plan with the part here")
        first = settled()
        if shots := os.environ.get("PENTAPOD_SHOTS"):
            page.set_viewport_size({"width": 1200, "height": 760})
            page.locator(".mantine-Notification-closeButton").first.click()  # what it thinks of a machine without GPU
            page.wait_for_timeout(3000)
            page.screenshot(path=Path(shots) / "view.png")
            page.set_viewport_size({"width": 960, "height": 600})
            first = settled()
        where = viewer.placement
        viewer.move(shifted(where, 0.25, 0.0, 0.0))
        page.wait_for_selector("text=Does not fit")
        assert (np.abs(settled() - first).max(axis=2) > 40).sum() > 500, "machine and part have moved"
        browser.close()
    assert said == []
