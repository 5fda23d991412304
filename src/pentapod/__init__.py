"""pentapod: from a surface mesh to a checked leg-length program for a five-legged parallel robot.

    mesh → Toolpath → PlacedPath → LegPath → Trajectory → Program → Verdict

The names below are imported when they are first used, so that `import pentapod` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pentapod.base import InputError as InputError
    from pentapod.base import PentapodError as PentapodError
    from pentapod.base import Refusal as Refusal
    from pentapod.base import RefusalError as RefusalError
    from pentapod.base.version import __version__ as __version__
    from pentapod.batch import Sweep as Sweep
    from pentapod.batch import batch as batch
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
    from pentapod.machine import CollisionWorld as CollisionWorld
    from pentapod.machine import Machine as Machine
    from pentapod.mesh import Mesh as Mesh
    from pentapod.mesh import Region as Region
    from pentapod.mesh import load_mesh as load_mesh
    from pentapod.mesh import write_stl as write_stl
    from pentapod.planning import LegPath as LegPath
    from pentapod.planning import PlacedPath as PlacedPath
    from pentapod.planning import Placement as Placement
    from pentapod.planning import PlacementConstraints as PlacementConstraints
    from pentapod.planning import Weights as Weights
    from pentapod.planning import leg_path as leg_path
    from pentapod.planning import plan as plan
    from pentapod.program import Program as Program
    from pentapod.program import Provenance as Provenance
    from pentapod.program import read_csv as read_csv
    from pentapod.program import sample as sample
    from pentapod.program import write_csv as write_csv
    from pentapod.program.posts import PostInput as PostInput
    from pentapod.program.posts import post_names as post_names
    from pentapod.program.posts import read_post as read_post
    from pentapod.program.posts import write_post as write_post
    from pentapod.report import write_report as write_report
    from pentapod.simulate import Played as Played
    from pentapod.simulate import Reference as Reference
    from pentapod.simulate import simulate_servo as simulate_servo
    from pentapod.timing import Explanation as Explanation
    from pentapod.timing import Trajectory as Trajectory
    from pentapod.timing import explain as explain
    from pentapod.timing import override as override
    from pentapod.timing import retime as retime
    from pentapod.toolpath import Between as Between
    from pentapod.toolpath import Cone as Cone
    from pentapod.toolpath import CrossHatchOptions as CrossHatchOptions
    from pentapod.toolpath import CurveOptions as CurveOptions
    from pentapod.toolpath import DrawingOptions as DrawingOptions
    from pentapod.toolpath import EdgeOptions as EdgeOptions
    from pentapod.toolpath import Fixed as Fixed
    from pentapod.toolpath import GougeOptions as GougeOptions
    from pentapod.toolpath import ImageOptions as ImageOptions
    from pentapod.toolpath import LinkStyle as LinkStyle
    from pentapod.toolpath import Normal as Normal
    from pentapod.toolpath import OffsetOptions as OffsetOptions
    from pentapod.toolpath import Orientation as Orientation
    from pentapod.toolpath import PencilOptions as PencilOptions
    from pentapod.toolpath import Pointed as Pointed
    from pentapod.toolpath import PolylineOptions as PolylineOptions
    from pentapod.toolpath import RasterOptions as RasterOptions
    from pentapod.toolpath import Remedy as Remedy
    from pentapod.toolpath import Segment as Segment
    from pentapod.toolpath import SegmentKind as SegmentKind
    from pentapod.toolpath import SpiralOptions as SpiralOptions
    from pentapod.toolpath import TextOptions as TextOptions
    from pentapod.toolpath import Toolpath as Toolpath
    from pentapod.toolpath import WaterlineOptions as WaterlineOptions
    from pentapod.toolpath import lettering as lettering
    from pentapod.toolpath import make_toolpath as make_toolpath
    from pentapod.toolpath import oriented as oriented
    from pentapod.toolpath import read_darkness as read_darkness
    from pentapod.toolpath import read_lines as read_lines
    from pentapod.toolpath import read_points as read_points
    from pentapod.toolpath import stepped as stepped
    from pentapod.toolpath import toolpath_with_report as toolpath_with_report
    from pentapod.toolpath import without_gouges as without_gouges
    from pentapod.toolpath.formats import RotaryAxes as RotaryAxes
    from pentapod.toolpath.formats import read_toolpath as read_toolpath
    from pentapod.toolpath.formats import write_toolpath as write_toolpath
    from pentapod.verify import Certificate as Certificate
    from pentapod.verify import Coverage as Coverage
    from pentapod.verify import Cutting as Cutting
    from pentapod.verify import NotJudged as NotJudged
    from pentapod.verify import Verdict as Verdict
    from pentapod.verify import verify as verify

_ROOMS = {
    "base": "InputError PentapodError Refusal RefusalError",
    "geometry": "RigidTransform",
    "mesh": "Mesh Region load_mesh write_stl",
    "cutters": "BallCutter BullNose FlatEnd Lollipop StandOff",
    "kinematics": "Component LinearPentapod",
    "machine": "Machine CollisionWorld",
    "toolpath": "Cone RasterOptions CrossHatchOptions WaterlineOptions OffsetOptions SpiralOptions PencilOptions "
    "EdgeOptions CurveOptions DrawingOptions TextOptions PolylineOptions ImageOptions lettering read_lines read_points "
    "read_darkness make_toolpath toolpath_with_report Orientation Normal Fixed Pointed Between oriented stepped "
    "GougeOptions Remedy LinkStyle without_gouges Segment SegmentKind Toolpath",
    "toolpath.formats": "read_toolpath write_toolpath RotaryAxes",
    "planning": "plan PlacementConstraints Weights Placement PlacedPath leg_path LegPath",
    "timing": "retime Trajectory explain Explanation override",
    "program": "sample Provenance Program write_csv read_csv",
    "program.posts": "PostInput post_names write_post read_post",
    "verify": "verify Coverage Cutting Certificate NotJudged Verdict",
    "simulate": "Reference simulate_servo Played",
    "job": "Job run judge Outcome",
    "report": "write_report",
    "batch": "batch Sweep",
    "base.version": "__version__",
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names.split()}

if not TYPE_CHECKING:  # type checkers read the imports above
    __all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    """Import a name of `__all__`. Raises AttributeError for others."""
    if name not in _HOMES:
        raise AttributeError(f"module 'pentapod' has no attribute {name!r}")
    home = import_module(f"pentapod.{_HOMES[name]}")
    if name in ("verify", "batch"):  # packages that can be called
        return home
    value = getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(_HOMES)
