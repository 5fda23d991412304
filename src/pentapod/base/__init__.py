"""Base: errors, refusals, values, registries, keys, files and versions. No mathematics."""

from pentapod.base.errors import (
    ArrayError,
    InputError,
    JobError,
    MachineError,
    MeshError,
    PentapodError,
    ProgramError,
    ToolpathError,
)
from pentapod.base.progress import Progress
from pentapod.base.refusal import Advice, Change, Refusal, RefusalError, Shortfall, stage
from pentapod.base.registry import Registry
from pentapod.base.values import Result, Value

__all__ = [
    "Advice",
    "ArrayError",
    "Change",
    "InputError",
    "JobError",
    "MachineError",
    "MeshError",
    "PentapodError",
    "ProgramError",
    "Progress",
    "Refusal",
    "RefusalError",
    "Registry",
    "Result",
    "Shortfall",
    "ToolpathError",
    "Value",
    "stage",
]
