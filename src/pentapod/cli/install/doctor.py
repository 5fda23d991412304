"""pentapod doctor: versions, extras, LinuxCNC, compiled kernels, and whether folders can be written."""

from __future__ import annotations

import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import click

from pentapod.cli.output import echo_json, json_option, quiet_option

FOR_INSTALL = ("dev",)
"""Extras for the development of pentapod, of which nothing is said."""


@dataclass(frozen=True)
class Finding:
    """One line of the examination. needed: whether pentapod does not work without."""

    name: str
    good: bool
    says: str
    needed: bool = False


@click.command()
@json_option
@quiet_option
def doctor(as_json: bool, quiet: bool) -> int:
    """Examine the installation: versions, extras, LinuxCNC, compiled kernels, folders that can be written.

    Exit code 1 if something is missing without which pentapod does not work.
    """
    from pentapod.base.version import __version__, processor_kind
    from pentapod.numerics.threads import cores

    found = [*_libraries(), *_extras(), _linuxcnc(), _kernels(), *_folders()]
    if as_json:
        echo_json({"pentapod": __version__, "findings": [asdict(finding) for finding in found]})
    elif not quiet:
        click.echo(f"pentapod {__version__}, {cores()} cores, {processor_kind()}")
        wide = max(len(finding.name) for finding in found)
        for finding in found:
            mark = "ok  " if finding.good else ("BAD " if finding.needed else "-   ")
            click.echo(f"  {mark}  {finding.name:<{wide}}  {finding.says}")
    return 0 if all(finding.good for finding in found if finding.needed) else 1


def _requirements() -> dict[str, list[str]]:
    """Return what pentapod requires by extra, "" for what it always requires; without versions."""
    import re
    from importlib.metadata import PackageNotFoundError, requires

    found: dict[str, list[str]] = {}
    try:
        lines = requires("pentapod") or []
    except PackageNotFoundError:  # run from a source tree that was never installed
        return found
    for line in lines:
        name, _, condition = line.partition(";")
        extra = re.search(r"extra\s*==\s*['\"]([\w-]+)['\"]", condition)
        package = re.match(r"[\w.-]+", name.strip())
        if package is not None:
            found.setdefault(extra.group(1) if extra else "", []).append(package.group())
    return found


def _version(package: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _libraries() -> list[Finding]:
    import platform
    import sys

    python = Finding("python", True, f"{platform.python_version()}, {sys.executable}", needed=True)
    packages = _requirements().get("", [])
    versions = {package: _version(package) for package in packages}
    missing = [package for package, version in versions.items() if version is None]
    says = ", ".join(f"{package} {version}" for package, version in versions.items() if version is not None)
    if missing:
        says = f"missing: {', '.join(missing)}; pip install pentapod installs them"
    return [python, Finding("libraries", not missing, says, needed=True)]


def _extras() -> list[Finding]:
    found: list[Finding] = []
    for extra, packages in sorted(_requirements().items()):
        if extra in ("", *FOR_INSTALL):
            continue
        versions = [_version(package) for package in packages]
        there = None not in versions
        named = ", ".join(f"{package} {version}" for package, version in zip(packages, versions, strict=True))
        found.append(Finding(f"extra {extra}", there, named if there else f'pip install "pentapod[{extra}]"'))
    return found


def _linuxcnc() -> Finding:
    import shutil

    program = shutil.which("linuxcnc")
    return Finding("LinuxCNC", program is not None, program or "not on this machine; only its own tests need it")


def _kernels() -> Finding:
    from numba import config

    from pentapod.numerics.kernel_cache import kernel_cache
    from pentapod.numerics.warm_up import signatures

    folder = kernel_cache(str(getattr(config, "CACHE_DIR", "")))
    listed = {name for name, _ in signatures()}
    if folder is None:
        return Finding("kernels", False, "cannot be kept: each run compiles them anew; NUMBA_CACHE_DIR names a folder")
    names = {path.name.split(".")[1].rpartition("-")[0] for path in folder.rglob("*.nbi")}
    ready = sum(name.partition(":")[2] in names for name in listed)
    says = f"{ready} of {len(listed)} compiled, in {folder}"
    return Finding("kernels", ready == len(listed), says + ("" if ready == len(listed) else "; pentapod warm-up"))


def _folders() -> list[Finding]:
    found: list[Finding] = []
    for name, folder in (("this folder", Path.cwd()), ("temporary files", Path(tempfile.gettempdir()))):
        try:
            with tempfile.TemporaryFile(dir=folder):
                found.append(Finding(name, True, f"{folder} can be written", needed=True))
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            found.append(Finding(name, False, f"{folder} cannot be written: {reason}", needed=True))
    return found
