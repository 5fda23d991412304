"""Many jobs, and sweeps of them, on the workers of Dask: each done once, its folder whole, tables of them all.

The package can be called like its function `batch`, since both have the name `pentapod.batch`.
"""

import sys
from types import ModuleType
from typing import Any

from pentapod.batch.engine import Done, Engine, EngineOptions
from pentapod.batch.run import Batch, batch
from pentapod.batch.store import Input, Store
from pentapod.batch.sweep import Sweep
from pentapod.batch.task import Row, Task

__all__ = ["Batch", "Done", "Engine", "EngineOptions", "Input", "Row", "Store", "Sweep", "Task", "batch"]


class _Callable(ModuleType):
    def __call__(self, *given: Any, **asked: Any) -> Batch:
        """Plan and verify jobs, as `run.batch`."""
        return batch(*given, **asked)


sys.modules[__name__].__class__ = _Callable
