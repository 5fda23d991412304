"""Jobs: schema of the job file, planning pipeline, outcome, output files, verdict on a run.

The names below are imported when they are first used, so that reading a job file needs no solver.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pentapod.job.advice.options import AdviceOptions as AdviceOptions
    from pentapod.job.advice.search import Advised as Advised
    from pentapod.job.advise import advise as advise
    from pentapod.job.outcome import Outcome as Outcome
    from pentapod.job.pipeline import run as run
    from pentapod.job.schema.job import Job as Job
    from pentapod.job.verdict import judge as judge

_HOMES = {
    "Advised": "advice.search",
    "AdviceOptions": "advice.options",
    "Job": "schema.job",
    "Outcome": "outcome",
    "advise": "advise",
    "judge": "verdict",
    "run": "pipeline",
}

__all__ = ["AdviceOptions", "Advised", "Job", "Outcome", "advise", "judge", "run"]


def __getattr__(name: str) -> Any:
    """Import a name of `__all__`. Raises AttributeError for others."""
    if name not in _HOMES:
        raise AttributeError(f"module 'pentapod.job' has no attribute {name!r}")
    value = getattr(import_module(f"pentapod.job.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
