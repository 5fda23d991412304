"""ViewedRun: a run as the viewer's page shows it, with what the page needs to move the part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from pentapod.base.arrays import as_floats
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.leg_ends import leg_ends
from pentapod.planning import PlacedPath
from pentapod.report.drawings.colours import LIMIT_COLOUR, RAMP
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import touch_off_points, touch_off_text
from pentapod.report.pack import MESH_STEP_MM, Packed
from pentapod.report.page.keys import legs_beside
from pentapod.report.page.page import TEMPLATE, ReportedRun, contents
from pentapod.report.page.scene import LIFT_M
from pentapod.report.signals import TimeLaw
from pentapod.report.template import page_text
from pentapod.view.motion import toolpath_motion
from pentapod.view.opened_run import OpenedRun
from pentapod.view.stored import placed_path, stored_law, stored_outcome
from pentapod.view.study import COMFORTABLE, Study
from pentapod.view.words import run_words

BEYOND_COLOUR = "#c000b8"
"""Of waypoints beyond a limit: no colour of the ramp is like it."""


@dataclass(frozen=True, eq=False)
class ViewedRun(ReportedRun):
    """A run on the report's page. read_back: its time law, where it was read from a folder."""

    opened: OpenedRun
    read_back: TimeLaw | None = None

    @classmethod
    def of(cls, opened: OpenedRun) -> Self:
        """Return the run of a folder. Raises InputError where a file of it is broken."""
        placed = placed_path(opened)
        return cls(stored_outcome(opened, placed), opened, stored_law(opened, placed))

    @property
    def law(self) -> TimeLaw | None:
        """The time law: read back, or of the outcome."""
        return super().law if self.read_back is None else self.read_back

    @cached_property
    def study(self) -> Study:
        """The margins of any placement."""
        return Study.of(self.opened)

    @property
    def placed(self) -> PlacedPath:
        """The toolpath at its placement."""
        placed = self.outcome.find(PlacedPath)
        return placed_path(self.opened) if placed is None else placed

    def motion(self, packed: Packed) -> dict[str, Any] | None:
        """Return the motion of the program, else along the toolpath."""
        found = super().motion(packed)
        return toolpath_motion(packed, self.placed, self.machine) if found is None else found

    def page(self, token: str, base: str) -> str:
        """Return the page. base: path of the server under which it asks about this run, with a token."""
        page, packed, context = contents(self)
        page["live"] = self._live(packed) | {"token": token, "base": base}
        words = {"note": run_words(self.opened), "leans": self.opened.job.axis.tilt_deg != 0.0}
        return page_text(TEMPLATE, page, packed, live=True, **context, **words)

    def joints_mm(self, placement: RigidTransform) -> list[float]:
        """Return the joints beside the tool axis at all keys of the motion, mm, with the part at a placement."""
        if self.keys is None or self.signals is None:
            tips, axes = self.placed.tips, self.placed.axes
        else:
            tips, axes = self.signals.tips[self.keys.rows], self.signals.axes[self.keys.rows]
        beside = legs_beside(self.machine, tips, axes)[0]
        moved = placement @ self.opened.placement.inverse()
        joints = leg_ends(self.machine, moved.apply(tips), moved.rotate(axes))[1][:, beside]
        return np.round(1e3 * joints.ravel(), 3).tolist()

    def touch_off(self, placement: RigidTransform) -> str:
        """Return the touch-off points of a placement as a CSV file, with the planned tool axes, which turn with it."""
        run = self.opened
        tips = placement.apply(run.toolpath.tilt_centres - run.toolpath.tilt_centre * run.axes)
        planned = PlannedRun(
            run.job, run.machine, run.mesh, run.tool, run.toolpath, placement, tips, placement.rotate(run.axes)
        )
        return touch_off_text(touch_off_points(planned))

    def _live(self, packed: Packed) -> dict[str, Any]:
        """Add the arrays of the path that is coloured live, and return what the page needs to move the part."""
        run, legs = self.opened, self.machine.legs
        rows = self.study.shown
        tips = run.toolpath.tilt_centres[rows] - run.toolpath.tilt_centre * run.axes[rows] + LIFT_M * run.axes[rows]
        packed.numbers("live.points", 1e3 * run.placement.apply(tips), MESH_STEP_MM)
        low, high = run.mesh.bounds
        return {
            "points": "live.points",
            "placement": numbers_of(run.placement),
            "middle": (1e3 * run.placement.apply(0.5 * (low + high))).tolist(),
            "ramp": RAMP, "comfortable": COMFORTABLE, "beyond": BEYOND_COLOUR, "tooFar": LIMIT_COLOUR,
            "strokes": [(1e3 * legs.min_length).tolist(), (1e3 * legs.max_length).tolist()],
        }  # fmt: skip


def numbers_of(placement: RigidTransform) -> list[float]:
    """Return a placement as the page has it: its rotation row by row, and its translation in mm."""
    return [*placement.rotation.ravel().tolist(), *(1e3 * placement.translation).tolist()]


def placement_of(numbers: list[float]) -> RigidTransform:
    """Return the placement of such numbers. Raises ArrayError where they are not one."""
    matrix = np.eye(4)
    values = as_floats(numbers, "placement", (12,))
    matrix[:3, :3], matrix[:3, 3] = values[:9].reshape(3, 3), 1e-3 * values[9:]
    return RigidTransform.from_matrix(matrix)
