"""The scripted pipeline: what its page shows is the example, and it prints the table of the page."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "examples" / "18_three_parts_two_tools.py"
PAGE = (ROOT / "docs" / "howto" / "script.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.S)


def test_the_page_shows_the_example_which_has_ten_statements():
    body = SCRIPT.read_text(encoding="utf-8").split('"""\n', 1)[1].strip() + "\n"
    assert body in BLOCKS
    code = [line for line in body.splitlines() if line and not line.startswith(("import", "from"))]
    assert len(code) <= 12


@pytest.mark.slow
def test_the_example_prints_the_table_of_the_page(tmp_path):
    done = subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, text=True, check=True, cwd=ROOT)
    assert f"```text\n{done.stdout}```" in PAGE
    assert (tmp_path / "wavy-8" / "program.csv").is_file()
