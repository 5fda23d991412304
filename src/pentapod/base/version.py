"""The version, read from the installed package's metadata (one source, pyproject.toml), and what else decides bits."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("pentapod")
except PackageNotFoundError:  # run from a source tree that was never installed
    __version__ = "0+unknown"

_LIBRARIES = ("numpy", "scipy", "casadi", "numba", "llvmlite")


@cache
def processor_kind() -> str:
    """Return architecture and kind of the processor, as the compiler of the kernels tells kinds apart."""
    from llvmlite import binding  # noqa: PLC0415  heavy; numba brings it, and whoever plans has loaded it

    return f"{platform.machine()} {binding.get_host_cpu_name()}"


@cache
def library_versions() -> str:
    """Return the versions of Python and of the libraries whose arithmetic a program goes through."""
    return ", ".join([f"python {platform.python_version()}", *(f"{name} {version(name)}" for name in _LIBRARIES)])
