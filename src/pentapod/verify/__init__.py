"""Verification of a program file: it is read, replayed and judged claim by claim, independently of the planner.

The package can be called like its function `verify`, since both have the name `pentapod.verify`.

>>> verdict = verify(program, machine, toolpath, tilt=0.0, path_tolerance=20e-6, axis_tolerance=np.radians(0.5))
>>> [entry.claim for entry in verdict.not_judged][-1]  # no collision_world was given
'legs, spindle and tool clear of the surroundings'
"""

import sys
from types import ModuleType
from typing import Any

from pentapod.verify.judge import CLAIM_NAMES, CLAIMS, judged, verify, write_verdict
from pentapod.verify.replay.claim import Claim
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.coverage import Coverage
from pentapod.verify.verdict.cutting import Cutting
from pentapod.verify.verdict.specification import Specification
from pentapod.verify.verdict.verdict import Certificate, NotJudged, Place, Sources, Verdict

__all__ = [
    "CLAIMS",
    "CLAIM_NAMES",
    "Certificate",
    "Claim",
    "Coverage",
    "Cutting",
    "NotJudged",
    "Place",
    "Replay",
    "Sources",
    "Specification",
    "Verdict",
    "judged",
    "verify",
    "write_verdict",
]


class _Callable(ModuleType):
    def __call__(self, *given: Any, **asked: Any) -> Any:
        """Return the verdict on a program, as `verify.verify`."""
        return verify(*given, **asked)


sys.modules[__name__].__class__ = _Callable
