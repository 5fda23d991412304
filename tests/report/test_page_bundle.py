"""The page's script: built from the sources that are here, of libraries that are named, with their licences."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from importlib import resources
from pathlib import Path

import pytest

WEB = Path(str(resources.files("pentapod.report") / "web"))
BUILT = "page.min.js"


def test_the_script_was_built_from_these_sources():
    """Its first line has their digest: whoever changes a source builds anew, `make page`."""
    digest = hashlib.sha256()
    sources = sorted(p for p in WEB.iterdir() if p.suffix in (".js", ".mjs", ".json") and p.name != BUILT)
    for path in sources:
        digest.update(f"{path.name}\n".encode())
        digest.update(path.read_bytes())
    with (WEB / BUILT).open(encoding="utf-8") as script:
        assert f"Sources: {digest.hexdigest()}" in script.readline()


def test_libraries_are_locked_without_an_address_and_have_licences():
    lock = json.loads((WEB / "package-lock.json").read_text(encoding="utf-8"))
    wanted = json.loads((WEB / "package.json").read_text(encoding="utf-8"))
    versions = {**wanted["dependencies"], **wanted["devDependencies"]}
    assert set(versions) == {"three", "uplot", "esbuild"}
    for name, version in versions.items():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version), name
        assert lock["packages"][f"node_modules/{name}"]["version"] == version
    assert all("resolved" not in entry for entry in lock["packages"].values())
    assert all("integrity" in entry for name, entry in lock["packages"].items() if name)
    licences = (WEB / "THIRD_PARTY.txt").read_text(encoding="utf-8")
    for name in wanted["dependencies"]:
        assert f"{name} {versions[name]}, MIT" in licences
    assert licences.count("Permission is hereby granted") == 2


def test_the_script_can_stand_in_a_page():
    text = (WEB / BUILT).read_text(encoding="utf-8")
    assert "</script" not in text
    assert "<!--" not in text


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("npm") is None, reason="npm is not installed; it builds the page's script")
def test_building_again_gives_the_same_script(tmp_path):
    for path in WEB.iterdir():
        if path.is_file():
            shutil.copy(path, tmp_path)
    installed = subprocess.run(
        ["npm", "ci", "--ignore-scripts"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    if installed.returncode and re.search(r"ENOTFOUND|ETIMEDOUT|ECONNREFUSED|EAI_AGAIN", installed.stderr):
        pytest.skip("no package registry can be reached")
    assert installed.returncode == 0, installed.stderr
    checked = subprocess.run(["npm", "run", "check"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    (tmp_path / "theme.js").write_text((tmp_path / "theme.js").read_text().replace("0.00", "0.01") + "\n")
    spoilt = subprocess.run(["npm", "run", "check"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert spoilt.returncode == 1
    assert "page.min.js is out of date" in spoilt.stderr
