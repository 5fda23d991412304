"""Pages ask for nothing: their policy forbids every request and every script but their own, in a browser, too."""

from __future__ import annotations

import base64
import hashlib
import re
import sys
from pathlib import Path

import pytest

from browsers import CHROMIUM, needs_chromium
from pentapod.report import write_report, write_simulation
from pentapod.simulate import Reference, Tracking, simulate_servo

sys.path.append(str(Path(__file__).parents[1] / "program"))
from short_motion import motion, placed

PAGES = ("report", "simulation")


@pytest.fixture(scope="module")
def pages(usual_run, tmp_path_factory):
    folder, outcome = tmp_path_factory.mktemp("pages"), usual_run[2]
    reference = Reference(*motion(duration=0.2))
    toolpath = placed().transformed(reference.program.placement.inverse())
    tracking = Tracking(simulate_servo(reference), reference, toolpath, 5e-5)
    return {
        "report": write_report(outcome, folder / "report.html"),
        "simulation": write_simulation(folder / "simulation.html", "motion", "servo", [], [("run", tracking)]),
    }


@pytest.mark.parametrize("name", PAGES)
def test_the_policy_allows_this_script_and_no_request(name, pages):
    text = pages[name].read_text(encoding="utf-8")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    rules = dict(rule.strip().split(" ", 1) for rule in policy[1].replace("&#39;", "'").split(";"))
    assert rules.pop("style-src") == "'unsafe-inline'"
    script = text[text.rindex("<script>") + len("<script>") : text.rindex("</script>")]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert rules.pop("script-src") == f"'sha256-{digest}'"
    assert set(rules.values()) == {"'none'"}
    assert "default-src" in rules
    assert re.findall(r"<(?:link|img|iframe|object|embed|base)\b", text) == []
    assert text.count("<script>") == 1


@needs_chromium
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", ["report", pytest.param("simulation", marks=pytest.mark.slow)])
def test_a_browser_is_asked_for_nothing(name, pages):
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as start:
        browser = start.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page()
        page.set_default_timeout(240_000)
        asked: list[str] = []
        refused: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda message: refused.append(message.text))
        page.goto(pages[name].as_uri())
        page.wait_for_selector("html[data-ready]", state="attached")
        plots = page.locator("#plots canvas").count()
        assert asked == [pages[name].as_uri()]
        # What would reach out is refused.
        page.evaluate(
            """() => { fetch("http://127.0.0.1:9/").catch(() => {}); new Image().src = "http://127.0.0.1:9/"; }"""
        )
        page.wait_for_timeout(200)
        browser.close()
    assert plots >= 3
    assert sum("Content Security Policy" in text for text in refused) >= 2
