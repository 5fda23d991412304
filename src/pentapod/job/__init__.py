"""Planning pipeline of one job: schema of the job file, run of the stages, outcome, output files.

The names below are loaded when they are first used: to read a job file needs no solver.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pentapod.job.outcome import Outcome as Outcome
    from pentapod.job.pipeline import run as run
    from pentapod.job.schema.job import Job as Job
    from pentapod.job.verdict import judge as judge

_HOMES = {"Job": "schema.job", "Outcome": "outcome", "judge": "verdict", "run": "pipeline"}

__all__ = ["Job", "Outcome", "judge", "run"]


def __getattr__(name: str) -> Any:
    """Load a name of `__all__` from where it lives. Raises AttributeError for others."""
    if name not in _HOMES:
        raise AttributeError(f"module 'pentapod.job' has no attribute {name!r}")
    value = getattr(import_module(f"pentapod.job.{_HOMES[name]}"), name)
    globals()[name] = value  # so that it is looked up once
    return value
