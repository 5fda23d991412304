"""What everything stands on: errors, refusals, arrays, files, versions. No mathematics."""

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
from pentapod.base.refusal import Blame, Refusal

__all__ = [
    "ArrayError",
    "Blame",
    "InputError",
    "JobError",
    "MachineError",
    "MeshError",
    "PentapodError",
    "ProgramError",
    "Progress",
    "Refusal",
    "ToolpathError",
]
