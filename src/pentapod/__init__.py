"""pentapod: from a surface mesh to a checked leg-length program for a five-legged parallel robot.

    mesh → Toolpath → PlacedPath → LegPath → Trajectory → Program → Verdict

The names below, in the order of the flow, are loaded when they are first used: `import pentapod` is light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pentapod.base import Refusal as Refusal
    from pentapod.base.version import __version__ as __version__
    from pentapod.cutters import BallCutter as BallCutter
    from pentapod.cutters import BullNose as BullNose
    from pentapod.cutters import FlatEnd as FlatEnd
    from pentapod.cutters import Lollipop as Lollipop
    from pentapod.cutters import StandOff as StandOff
    from pentapod.geometry import RigidTransform as RigidTransform
    from pentapod.job import Job as Job
    from pentapod.job import Outcome as Outcome
    from pentapod.job import judge as judge
    from pentapod.job import run as run
    from pentapod.kinematics import Component as Component
    from pentapod.kinematics import LinearPentapod as LinearPentapod
    from pentapod.machine import Machine as Machine
    from pentapod.machine import Surroundings as Surroundings
    from pentapod.mesh import Mesh as Mesh
    from pentapod.mesh import load_mesh as load_mesh
    from pentapod.planning import LegPath as LegPath
    from pentapod.planning import PlacedPath as PlacedPath
    from pentapod.planning import Placement as Placement
    from pentapod.planning import PlacementConstraints as PlacementConstraints
    from pentapod.planning import leg_path as leg_path
    from pentapod.planning import plan as plan
    from pentapod.program import Program as Program
    from pentapod.program import Provenance as Provenance
    from pentapod.program import read_csv as read_csv
    from pentapod.program import sample as sample
    from pentapod.program import write_csv as write_csv
    from pentapod.report import write_report as write_report
    from pentapod.timing import Trajectory as Trajectory
    from pentapod.timing import retime as retime
    from pentapod.toolpath import Cone as Cone
    from pentapod.toolpath import GougeOptions as GougeOptions
    from pentapod.toolpath import Orientation as Orientation
    from pentapod.toolpath import RasterOptions as RasterOptions
    from pentapod.toolpath import Remedy as Remedy
    from pentapod.toolpath import Toolpath as Toolpath
    from pentapod.toolpath import make_toolpath as make_toolpath
    from pentapod.toolpath import oriented as oriented
    from pentapod.toolpath import without_gouges as without_gouges
    from pentapod.verify import Certificate as Certificate
    from pentapod.verify import Coverage as Coverage
    from pentapod.verify import Cutting as Cutting
    from pentapod.verify import NotJudged as NotJudged
    from pentapod.verify import Verdict as Verdict

# `verify` is the one verb that is missing: it has the name of its package. `from pentapod.verify import verify`.
_HOMES = {
    "Machine": "machine",
    "Surroundings": "machine",
    "LinearPentapod": "kinematics",
    "Component": "kinematics",
    "RigidTransform": "geometry",
    "load_mesh": "mesh",
    "Mesh": "mesh",
    "BallCutter": "cutters",
    "FlatEnd": "cutters",
    "BullNose": "cutters",
    "Lollipop": "cutters",
    "StandOff": "cutters",
    "Cone": "toolpath",
    "RasterOptions": "toolpath",
    "Orientation": "toolpath",
    "GougeOptions": "toolpath",
    "Remedy": "toolpath",
    "make_toolpath": "toolpath",
    "oriented": "toolpath",
    "without_gouges": "toolpath",
    "Toolpath": "toolpath",
    "plan": "planning",
    "PlacementConstraints": "planning",
    "Placement": "planning",
    "PlacedPath": "planning",
    "leg_path": "planning",
    "LegPath": "planning",
    "retime": "timing",
    "Trajectory": "timing",
    "sample": "program",
    "Provenance": "program",
    "Program": "program",
    "write_csv": "program",
    "read_csv": "program",
    "Certificate": "verify",
    "NotJudged": "verify",
    "Coverage": "verify",
    "Cutting": "verify",
    "Verdict": "verify",
    "Refusal": "base",
    "Job": "job",
    "run": "job",
    "judge": "job",
    "Outcome": "job",
    "write_report": "report",
    "__version__": "base.version",
}

__all__ = [  # noqa: RUF022 - in the order of the flow
    "Machine",
    "Surroundings",
    "LinearPentapod",
    "Component",
    "RigidTransform",
    "load_mesh",
    "Mesh",
    "BallCutter",
    "FlatEnd",
    "BullNose",
    "Lollipop",
    "StandOff",
    "Cone",
    "RasterOptions",
    "Orientation",
    "GougeOptions",
    "Remedy",
    "make_toolpath",
    "oriented",
    "without_gouges",
    "Toolpath",
    "plan",
    "PlacementConstraints",
    "Placement",
    "PlacedPath",
    "leg_path",
    "LegPath",
    "retime",
    "Trajectory",
    "sample",
    "Provenance",
    "Program",
    "write_csv",
    "read_csv",
    "Certificate",
    "NotJudged",
    "Coverage",
    "Cutting",
    "Verdict",
    "Refusal",
    "Job",
    "run",
    "judge",
    "Outcome",
    "write_report",
    "__version__",
]


def __getattr__(name: str) -> Any:
    """Load a name of `__all__` from where it lives. Raises AttributeError for others."""
    if name not in _HOMES:
        raise AttributeError(f"module 'pentapod' has no attribute {name!r}")
    value = getattr(import_module(f"pentapod.{_HOMES[name]}"), name)
    globals()[name] = value  # so that it is looked up once
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
