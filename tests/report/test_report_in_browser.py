"""The report in a real browser, headless Chromium: no error, pixels in 3D, a slider that moves the legs, legible text.

PENTAPOD_SHOTS names a folder for screenshots, light, dark and on paper.
"""

from __future__ import annotations

import io
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from pentapod.job import Job, run
from pentapod.report import write_report

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = os.environ.get("PENTAPOD_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium; PENTAPOD_CHROMIUM may name one"),
    # What playwright leaves to the garbage collector is no fault of the page.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

PATIENCE_MS = 240_000  # a busy machine without a GPU is no failure

CONTRAST = """() => {
  const parse = (text) => {
    const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number);
    return [r, g, b, a];
  };
  const light = ([r, g, b]) => {
    const part = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const ground = (node) => {
    for (; node; node = node.parentElement) {
      const colour = parse(getComputedStyle(node).backgroundColor);
      if (colour[3] > 0) return colour;
    }
    return [255, 255, 255, 1];
  };
  const found = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode.parentElement;
    const hidden = !node.getClientRects().length || ["SCRIPT", "STYLE", "NOSCRIPT"].includes(node.tagName);
    if (hidden || node.closest(".figure") || !walk.currentNode.textContent.trim()) continue;
    const a = light(parse(getComputedStyle(node).color)), b = light(ground(node));
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    found.push([ratio, walk.currentNode.textContent.trim().slice(0, 40)]);
  }
  return found;
}"""

SHOWN = """() => document.getElementById("scene").data
  .filter((trace) => /^cuts/.test(trace.name) && trace.visible !== false).map((trace) => trace.name)"""

# The platform end of a leg, as the page draws it.
LEG = """(k) => {
  const holder = document.getElementById("scene");
  const trace = holder.data.find((t) => t.name === `leg ${k}`);
  return [trace.x, trace.y, trace.z].map((v) => v[v.length - 1]);
}"""


@pytest.fixture(scope="module")
def chromium():
    with playwright.sync_playwright() as start:
        browser = start.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of the small job of all tests."""
    from pentapod.cli.commands.new import dome_stl
    from usual_job import job_text

    folder = tmp_path_factory.mktemp("report")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_text(), encoding="utf-8")
    outcome = run(Job.load(folder / "job.toml"), folder / "out")
    return write_report(outcome, folder / "report.html"), outcome


class Opened:
    """The report on a page, drawn; what the console said besides."""

    def __init__(self, browser, file, scheme="light"):
        self.page = browser.new_page(viewport={"width": 1280, "height": 900}, color_scheme=scheme)
        self.page.set_default_timeout(PATIENCE_MS)
        self.said = []
        self.page.on("console", lambda m: self.said.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.goto(file.as_uri())
        self.page.wait_for_selector("#scene canvas")
        self.page.wait_for_selector("#time .main-svg")
        self.page.wait_for_function("document.getElementById('readout').textContent !== ''")

    def errors(self):
        """What was said, but for hints about speed, of the plotting library and of machines without a GPU."""
        hints = ("GPU stall", "swiftshader", "willReadFrequently")
        return [text for text in self.said if not any(hint.lower() in text.lower() for hint in hints)]


@pytest.fixture(scope="module", params=["light", "dark"])
def opened(request, chromium, report):
    page = Opened(chromium, report[0], request.param)
    if shots := os.environ.get("PENTAPOD_SHOTS"):
        page.page.screenshot(path=Path(shots) / f"report-{request.param}.png", full_page=True)
        if request.param == "light":
            page.page.locator("section", has=page.page.locator("#scene")).screenshot(path=Path(shots) / "report.png")
    yield page
    page.page.close()


def changed(before, after, by=30):
    """How many pixels differ; a colour bar may take a column or two from the canvas."""
    width = min(before.shape[1], after.shape[1])
    return int((np.abs(after[:, :width] - before[:, :width]).max(axis=2) > by).sum())


def pixels(page, selector):
    """The picture (h, w, 3) of an element, as it is on the screen."""
    from matplotlib.image import imread

    return (imread(io.BytesIO(page.locator(selector).screenshot()))[..., :3] * 255).astype(np.int16)


def test_report_page_loads_without_console_messages(opened):
    assert opened.errors() == []
    picture = pixels(opened.page, "#scene canvas")
    ground = picture[5, 5]
    coloured = np.abs(picture - ground).max(axis=2) > 40
    assert coloured.mean() > 0.02
    assert len(np.unique(picture[coloured] // 32, axis=0)) > 12


def test_report_text_has_contrast(opened):
    """WCAG AA: 4.5 to 1 for text."""
    found = opened.page.evaluate(CONTRAST)
    assert len(found) > 100
    assert [text for ratio, text in found if ratio < 4.5] == []


def test_the_slider_moves_the_legs_and_the_tool(opened, report):
    page, (_, outcome) = opened.page, report
    before = [page.evaluate(LEG, k) for k in range(1, 6)]
    picture = pixels(page, ".figure.scene")
    slider = page.locator("#slider")
    slider.evaluate("node => { node.value = 0; node.dispatchEvent(new Event('input')); }")
    after = [page.evaluate(LEG, k) for k in range(1, 6)]
    assert all(np.linalg.norm(np.subtract(a, b)) > 0.5 for a, b in zip(before, after, strict=True))
    page.wait_for_timeout(300)
    assert changed(picture, pixels(page, ".figure.scene")) > 50
    # The legs that are drawn have the lengths of the program's first row.
    from pentapod.program import Program

    base = np.column_stack([1e3 * outcome.machine.robot.base, np.zeros(5)])
    lengths = np.linalg.norm(np.array(after) - base, axis=1)
    assert lengths == pytest.approx(1e3 * outcome.find(Program).legs[0], abs=5e-3)
    assert page.locator("#readout").text_content().startswith("0.00 s")
    assert opened.errors() == []


def test_links_of_the_verdict_lead_to_their_places(opened, report):
    page, (_, outcome) = opened.page, report
    links = page.locator("a.go")
    placed = [c for c in outcome.verdict.certificates if c.where.time_s is not None]
    assert links.count() >= len(placed)
    claim = next(c for c in placed if c.claim == "leg rates")
    page.locator("tr", has_text="leg rates").locator("a.go").first.click()
    seconds = float(page.locator("#readout").text_content().split(" s")[0])
    assert seconds == pytest.approx(claim.where.time_s, abs=6e-3)
    # The plots follow: their cursor stands there.
    cursor = page.evaluate("document.getElementById('time').layout.shapes[0].x0")
    assert cursor == pytest.approx(claim.where.time_s, abs=1e-3)


@pytest.mark.parametrize("kind", ["feed", "cause", "margin"])
def test_the_path_is_coloured_by(opened, kind):
    page = opened.page
    if page.locator("#near").get_attribute("aria-pressed") == "false":
        page.locator("#near").click()
    page.select_option("#colour", "feed" if kind == "margin" else "margin")
    page.wait_for_timeout(300)
    before = pixels(page, ".figure.scene")
    page.select_option("#colour", kind)
    page.wait_for_timeout(300)
    shown = page.evaluate(SHOWN)
    assert len(shown) == 1
    assert {"feed": "feed", "cause": "limits", "margin": "margin"}[kind] in shown[0]
    assert changed(before, pixels(page, ".figure.scene")) > 200
    assert opened.errors() == []


def test_report_on_a_dark_screen_prints_black_on_white(opened):
    page = opened.page
    ink = "() => ['scene', 'time'].map(id => document.getElementById(id).layout.font.color)"
    before = page.evaluate(ink)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate(ink) == ["#000000", "#000000"]
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(ink) == before


def test_report_prints_on_a4(chromium, report, tmp_path):
    opened = Opened(chromium, report[0])
    opened.page.emulate_media(media="print")
    pdf = opened.page.pdf(path=tmp_path / "report.pdf", prefer_css_page_size=True)
    assert re.search(rb"/MediaBox \[0 0 59[45]\.?\d* 84[12]", pdf), "A4 in points"
    # Figures keep the pixels of the screen and are scaled to the paper.
    figures = opened.page.evaluate(
        "[...document.querySelectorAll('.figure .main-svg')].map(n => n.getBoundingClientRect().width)"
    )
    assert len(figures) >= 2
    assert max(figures) == pytest.approx(700, abs=4)
    # Nothing is wider than the paper, less its margins: 186 mm at 96 dots an inch.
    opened.page.set_viewport_size({"width": 703, "height": 1000})
    wide = opened.page.evaluate(
        "[...document.querySelectorAll('table, pre, dl, p')].filter(n => n.scrollWidth > 704).length"
    )
    assert wide == 0
    shots = os.environ.get("PENTAPOD_SHOTS")
    if shots:
        (Path(shots) / "report.pdf").write_bytes(pdf)
        opened.page.screenshot(path=Path(shots) / "report-paper.png", full_page=True)
    opened.page.close()


def test_a_telephone_shows_the_report_without_scrolling_sideways(chromium, report):
    narrow = chromium.new_page(viewport={"width": 390, "height": 844})
    narrow.set_default_timeout(PATIENCE_MS)
    narrow.goto(report[0].as_uri())
    narrow.wait_for_function("document.getElementById('readout').textContent !== ''")
    assert narrow.evaluate("document.documentElement.scrollWidth") <= 390
    narrow.close()
