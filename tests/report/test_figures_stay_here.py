"""No figure offers to upload itself: plotly.js has a button "Share chart…" that sends it to a public server."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, run
from pentapod.report import write_report, write_simulation
from pentapod.simulate import Reference, Tracking, simulate_servo
from usual_job import job_text

sys.path.append(str(Path(__file__).parents[1] / "program"))
from short_motion import motion, placed

CHROMIUM = os.environ.get("PENTAPOD_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
PAGES = ("report", "simulation")
UPLOADING = """() => [...document.querySelectorAll(".js-plotly-plot")].map((figure) => [
  figure._context.showSendToCloud, figure._context.plotlyServerURL,
  figure.querySelectorAll('.modebar-btn').length, figure.querySelectorAll('[data-title*="Share" i], .watermark').length,
])"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_text(), encoding="utf-8")
    outcome = run(Job.load(folder / "job.toml"), folder / "out")
    reference = Reference(*motion(duration=0.2))
    toolpath = placed().transformed(reference.program.placement.inverse())
    tracking = Tracking(simulate_servo(reference), reference, toolpath, 5e-5)
    return {
        "report": write_report(outcome, folder / "report.html"),
        "simulation": write_simulation(folder / "simulation.html", "motion", "servo", [], [("run", tracking)]),
    }


@pytest.mark.parametrize("name", PAGES)
def test_every_figure_is_told_before_it_is_drawn(name, pages):
    text = pages[name].read_text(encoding="utf-8")
    told = re.search(r"Plotly\.setPlotConfig\((\{.*?\})\)", text)
    assert told, "no figure is told anything"
    config = json.loads(told[1])
    assert config["showSendToCloud"] is False
    assert config["plotlyServerURL"] == ""
    assert config["displaylogo"] is False
    after = text[told.end() :]
    assert re.search(r"Plotly\.(newPlot|react)\(", after)
    assert told.start() - text.rindex("</script>", 0, told.start()) < 40, "next to the library"
    assert "showSendToCloud" not in after, "no figure is told otherwise"
    assert "plotlyServerURL" not in after
    assert "sendDataToCloud" not in after


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium; PENTAPOD_CHROMIUM may name one")
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", PAGES)
def test_no_figure_has_the_button(name, pages):
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as start:
        browser = start.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page()
        page.set_default_timeout(240_000)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto(pages[name].as_uri())
        page.wait_for_selector(".js-plotly-plot .main-svg")
        figures = page.evaluate(UPLOADING)
        browser.close()
    assert figures
    for shows, server, buttons, shares in figures:
        assert (shows, server, shares) == (False, "", 0)
        assert buttons > 0
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
