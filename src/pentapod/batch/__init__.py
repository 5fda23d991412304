"""Many jobs, and sweeps of them, on the workers of Dask: each done once, its folder whole, tables of them all.

The package can be called like its function `batch`, since both have the name `pentapod.batch`. The names below are
imported when they are first used, so that the processes of the workers start quickly.

>>> for done in batch([Job.load("job.toml")], "runs", workers=2):  # doctest: +SKIP
...     print(done.status, done.row["cycle_time_s"])
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pentapod.base.registry import imported_when_used

if TYPE_CHECKING:
    from pentapod.batch.run import Batch as Batch
    from pentapod.batch.run import batch as batch
    from pentapod.batch.sweep import Sweep as Sweep
    from pentapod.batch.tasks.engine import Done as Done
    from pentapod.batch.tasks.engine import Engine as Engine
    from pentapod.batch.tasks.engine import EngineOptions as EngineOptions
    from pentapod.batch.tasks.store import Input as Input
    from pentapod.batch.tasks.store import Store as Store
    from pentapod.batch.tasks.task import Task as Task

_HOMES = {
    "batch.run": "Batch batch",
    "batch.sweep": "Sweep",
    "batch.tasks.engine": "Done Engine EngineOptions",
    "batch.tasks.store": "Input Store",
    "batch.tasks.task": "Task",
}

if not TYPE_CHECKING:  # type checkers read the imports above
    __getattr__, __dir__, __all__ = imported_when_used(__name__, _HOMES)


class _Callable(ModuleType):
    def __call__(self, *given: Any, **asked: Any) -> Batch:
        """Plan and verify jobs, as `run.batch`."""
        return sys.modules[__name__].batch(*given, **asked)


sys.modules[__name__].__class__ = _Callable
