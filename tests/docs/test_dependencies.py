"""What is installed: every dependency has its line and licence in the docs, and one version that `make` takes."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONSTRAINTS = (ROOT / "constraints.txt").read_text(encoding="utf-8")


def numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(".")]


def declared() -> dict[str, list[int]]:
    """Lower bounds by name."""
    lines = [*PROJECT["dependencies"], *(line for extra in PROJECT["optional-dependencies"].values() for line in extra)]
    found = [re.match(r"([A-Za-z0-9_.-]+)[>=]=([0-9.]+)", line) for line in lines]
    assert all(found)
    return {match[1].lower(): numbers(match[2]) for match in found if match}


def test_each_has_a_line_and_a_licence():
    rows = re.findall(r"^\| `([^`]+)` \| [^|]+ \| [^|]+ \|$", (ROOT / "docs/dependencies.md").read_text("utf-8"), re.M)
    assert sorted(rows) == sorted(declared())


def test_make_installs_one_version_of_each_within_its_bounds():
    pinned = dict(re.findall(r"^([A-Za-z0-9_.-]+)==([0-9.]+)$", CONSTRAINTS, re.M))
    pinned = {name.lower().replace("_", "-"): version for name, version in pinned.items()}
    for name, lowest in declared().items():
        assert numbers(pinned[name]) >= lowest, name
    assert "numba" in pinned
    assert "llvmlite" in pinned, "what dependencies need is pinned too"
    assert not re.search("@|/", CONSTRAINTS), "no addresses: whoever installs has an index of their own"


def test_the_licence_is_there_and_is_the_one_declared():
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert text.startswith("MIT License\n")
    assert PROJECT["authors"][0]["name"] in text
    assert (PROJECT["license"], PROJECT["license-files"]) == ("MIT", ["LICENSE"])
