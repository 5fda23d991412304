"""Versions of pentapod and of the libraries, and the processor, which determine the bits of a result."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("pentapod")
except PackageNotFoundError:  # run from a source tree that was never installed
    __version__ = "0+unknown"

LIBRARIES = ("numpy", "scipy", "casadi", "numba", "llvmlite")


@cache
def processor_kind() -> str:
    """Return architecture and model of the processor, as LLVM names them."""
    from llvmlite import binding  # noqa: PLC0415  heavy

    return f"{platform.machine()} {binding.get_host_cpu_name()}"


@cache
def library_versions() -> str:
    """Return the versions of Python and of the libraries that compute a program."""
    return ", ".join([f"python {platform.python_version()}", *(f"{name} {version(name)}" for name in LIBRARIES)])
