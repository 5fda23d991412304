"""The set-up sheet in a real browser: one page of A4 for each set-up, no label on another, telephone, dark, no request.

PENTAPOD_SHOTS names a folder for screenshots.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from browsers import CHROMIUM, IN_A_BROWSER, PATIENCE_MS
from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, run
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.sheet.page import SheetPage, write_pages
from usual_job import job_text

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = IN_A_BROWSER

OVERLAPS = """() => [...document.querySelectorAll("figure svg")].flatMap((svg) => {
  const frame = svg.getBoundingClientRect();
  const boxes = [...svg.querySelectorAll("text[class]")].map((node) => {
    const box = node.getBoundingClientRect();  // the line's height; letters take the middle of it
    return {text: node.textContent, left: box.left, right: box.right, top: box.top + 0.2 * box.height,
            bottom: box.bottom - 0.2 * box.height};
  });
  const cut = boxes.filter((b) => b.left < frame.left - 1 || b.right > frame.right + 1);
  const found = cut.map((b) => `cut off: ${b.text}`);
  boxes.forEach((a, k) => boxes.slice(k + 1).forEach((b) => {
    const over = a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    if (over) found.push(`${a.text} on ${b.text}`);
  }));
  return found;
})"""


@pytest.fixture(scope="module")
def chromium():
    with playwright.sync_playwright() as start:
        browser = start.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def sheets(tmp_path_factory):
    """Two sheets of the small job: of one page, and of two as of a job in two set-ups, with a tilted part."""
    folder = tmp_path_factory.mktemp("sheet") / "dome"
    folder.mkdir()
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    text = job_text().replace("rotation_deg = [180, 0, 0]", "rotation_deg = [171, 4, 30]")
    (folder / "job.toml").write_text(text.replace("diameter_mm = 10", "diameter_mm = 10\nshank_mm = [[30, 8, 10]]"))
    shown = PlannedRun.of(run(Job.load(folder / "job.toml"), folder / "out"))
    assert shown is not None
    pages = [SheetPage(shown, name, "0123456789abcdef" * 4, True) for name in ("set-up 1", "set-up 2")]
    return [write_pages(pages[:count], folder / f"sheet-{count}.html") for count in (1, 2)]


def opened(browser, file, width, height=1000, scheme="light"):
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    page.set_default_timeout(PATIENCE_MS)
    page.said = []
    page.on("console", lambda message: page.said.append(message.text))
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.on("request", lambda request: page.said.append(request.url) if request.url != file.as_uri() else None)
    page.goto(file.as_uri())
    return page


def pages_in(pdf: bytes) -> int:
    assert re.search(rb"/MediaBox \[0 0 59[45]\.?\d* 84[12]", pdf), "A4 in points"
    return len(re.findall(rb"/Type\s*/Page\b(?!s)", pdf))


@pytest.mark.parametrize("count", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_sheet_prints_a_page_for_each_set_up(chromium, sheets, count):
    page = opened(chromium, sheets[count - 1], 800)
    pdf = page.pdf(prefer_css_page_size=True)
    assert pages_in(pdf) == count
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 703, "height": 1047})  # A4 less its margins, at 96 dots an inch
    assert page.evaluate("document.documentElement.scrollWidth") <= 703
    high = page.evaluate("[...document.querySelectorAll('.page')].map((node) => node.scrollHeight)")
    assert len(high) == count
    assert max(high) < 1047 - 20, "room for longer texts"
    assert page.evaluate(OVERLAPS) == []
    if (shots := os.environ.get("PENTAPOD_SHOTS")) and count == 1:
        page.emulate_media(media="screen")
        page.set_viewport_size({"width": 820, "height": 1000})
        page.screenshot(path=Path(shots) / "sheet.png", full_page=True)
    page.close()


@pytest.mark.parametrize(
    ("scheme", "width"),
    [("light", 1280), *(pytest.param(*each, marks=pytest.mark.slow) for each in
                        (("light", 390), ("dark", 390), ("dark", 1280)))],
)  # fmt: skip
def test_sheet_on_a_screen_is_quiet_and_legible(chromium, sheets, width, scheme):
    page = opened(chromium, sheets[0], width, scheme=scheme)
    assert page.said == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(OVERLAPS) == []
    letters = "[...document.querySelectorAll('figure text[class]')].map((node) => node.getBoundingClientRect().height)"
    assert min(page.evaluate(letters)) > 9.5
    narrow = (
        "[...document.querySelectorAll('.scroll')].filter((node) => node.scrollWidth > node.clientWidth + 1).length"
    )
    assert width == 390 or page.evaluate(narrow) == 0
    page.locator("input[type=checkbox]").first.check()
    if shots := os.environ.get("PENTAPOD_SHOTS"):
        page.screenshot(path=Path(shots) / f"sheet-{width}-{scheme}.png", full_page=True)
    page.close()
