"""Jobs: schema of the job file, planning pipeline, outcome, output files, verdict on a run.

The names below are imported when they are first used, so that reading a job file needs no solver.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pentapod.base.registry import imported_when_used

if TYPE_CHECKING:
    from pentapod.job.advice.options import AdviceOptions as AdviceOptions
    from pentapod.job.advice.search import Advised as Advised
    from pentapod.job.outcome import Outcome as Outcome
    from pentapod.job.pipeline.advice_on_errors import advise as advise
    from pentapod.job.pipeline.run import run as run
    from pentapod.job.schema.job import Job as Job
    from pentapod.job.verdict import judge as judge

_HOMES = {
    "job.advice.options": "AdviceOptions",
    "job.advice.search": "Advised",
    "job.pipeline.advice_on_errors": "advise",
    "job.outcome": "Outcome",
    "job.pipeline.run": "run",
    "job.schema.job": "Job",
    "job.verdict": "judge",
}

if not TYPE_CHECKING:  # type checkers read the imports above
    __getattr__, __dir__, __all__ = imported_when_used(__name__, _HOMES)
