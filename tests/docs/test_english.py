"""Plain English: sentences of a page are short on average, and one form of `pip install` is used everywhere."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES += sorted((ROOT / "docs" / "howto").glob("*.md"))
MEAN, LONGEST = 17.0, 40
"""Words of a sentence, on average and at most."""

NOT_HELD = ("proofs.md", "gallery.md")
"""A theorem is one sentence; captions of pictures are lists."""


def sentences(text: str) -> list[str]:
    """The sentences of paragraphs and lists; code, tables and headings are left out, code in a line is one word."""
    text = re.sub(r"<!--.*?-->|```.*?```", "\n\n", text, flags=re.S)
    text = re.sub(r"^(#|\||!\[|    \S).*$", "\n", text, flags=re.M)
    text = re.sub(r"`[^`]*`", "code", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text))
    paragraphs = re.split(r"\n\s*\n|\n\s*(?=[-*] |\d+\. )", text)
    found = [re.split(r"(?<=[.!?])\s+", " ".join(paragraph.split())) for paragraph in paragraphs]
    return [sentence for each in found for sentence in each if len(sentence.split()) > 2]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_sentences_are_short(page):
    found = sentences(page.read_text(encoding="utf-8"))
    counts = [len(sentence.split()) for sentence in found]
    if page.name not in NOT_HELD and counts:
        assert sum(counts) / len(counts) <= MEAN
        assert max(counts) <= LONGEST, found[counts.index(max(counts))]


def test_quickstart_is_one_page():
    assert len((ROOT / "docs" / "quickstart.md").read_text(encoding="utf-8").splitlines()) <= 50


def test_pip_install_is_written_in_one_way():
    """`pip install .` for pentapod, `pip install "pentapod[extra]"` for an extra that there is."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = set(project["optional-dependencies"]) | {"{extra}", "…"}
    others = {"examples/plugin", "pentapod", '-e ".[dev]"'}
    files = [*PAGES, *(ROOT / "src").rglob("*.py"), *(ROOT / "examples").rglob("*.md")]
    for path in files:
        for asked in re.findall(r"pip install ((?:-e )?(?:\"[^\"]*\"|[^\s`;:,]+))", path.read_text(encoding="utf-8")):
            extra = re.fullmatch(r'"pentapod\[([^\]]+)\]"', asked)
            assert asked in others | {"."} or (extra and extra[1] in extras), f"{path}: {asked}"


def test_the_citation_file_is_of_this_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {project['version']}\n" in text
    assert f"\nlicense: {project['license']}\n" in text
    assert project["authors"][0]["name"] in text
