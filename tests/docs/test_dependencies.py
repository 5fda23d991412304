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
    found = [re.match(r"([A-Za-z0-9_.-]+)(?:\[[a-z]+\])?[>=]=([0-9.]+)", line) for line in lines]
    assert all(found)
    return {match[1].lower(): numbers(match[2]) for match in found if match}


def test_each_has_a_line_and_a_licence():
    rows = re.findall(r"^\| `([^`]+)` \| [^|]+ \| [^|]+ \|$", (ROOT / "docs/dependencies.md").read_text("utf-8"), re.M)
    assert sorted(rows) == sorted(declared())


def locked() -> list[tuple[str, str, str, list[str]]]:
    """Name, version, condition and hashes of each release in the lock file."""
    text = CONSTRAINTS.replace("\\\n", " ")
    rows = [line.split("--hash=sha256:") for line in text.splitlines() if not line.startswith("#")]
    found = []
    for head, *hashes in rows:
        release, _, condition = head.partition(";")
        name, _, version = release.strip().partition("==")
        found.append((name, version, condition.strip(), [value.strip() for value in hashes]))
    return found


def test_make_installs_one_version_of_each_within_its_bounds():
    pinned: dict[str, list[str]] = {}
    for name, version, _, _ in locked():
        pinned.setdefault(name, []).append(version)
    for name, lowest in declared().items():
        assert all(numbers(version) >= lowest for version in pinned[name]), name
    assert "numba" in pinned
    assert "llvmlite" in pinned, "what dependencies need is pinned too"
    for name, versions in pinned.items():
        conditions = [condition for other, _, condition, _ in locked() if other == name]
        each_for_other_pythons = all(condition.startswith("python_full_version") for condition in conditions)
        assert len(versions) == 1 or each_for_other_pythons, name
    assert not re.search("@|/", CONSTRAINTS), "no addresses: whoever installs has an index of their own"


def test_make_installs_no_file_without_its_hash():
    for name, _, _, hashes in locked():
        assert hashes, name
        assert all(re.fullmatch("[0-9a-f]{64}", value) for value in hashes), name
    ready = (ROOT / "Makefile").read_text("utf-8").partition("\n$(READY):")[2].partition("\n\n")[0]
    installs = [line for line in ready.splitlines() if " pip install" in line]
    assert len(installs) == 2
    assert "--require-hashes --requirement constraints.txt" in installs[0]
    assert "--no-deps --no-build-isolation --editable ." in installs[1]
    assert "hatchling" in {name for name, *_ in locked()}


def test_the_licence_is_there_and_is_the_one_declared():
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert text.startswith("MIT License\n")
    assert PROJECT["authors"][0]["name"] in text
    assert (PROJECT["license"], PROJECT["license-files"]) == ("MIT", ["LICENSE"])
