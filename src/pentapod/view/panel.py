"""Panel: the controls beside the scene, and their texts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pentapod.geometry.rigid import RigidTransform
from pentapod.job.build.placement import rotation_angles_deg
from pentapod.report.words import duration, number
from pentapod.view.motion import MachinePose, ToolMotion
from pentapod.view.opened_run import OpenedRun
from pentapod.view.study import Reach

if TYPE_CHECKING:
    import viser

SPEEDS = ("1/4 ×", "1 ×", "4 ×", "16 ×", "64 ×")
_FACTORS = dict(zip(SPEEDS, (0.25, 1.0, 4.0, 16.0, 64.0), strict=True))
SLIDER_STEPS = 2000


class Panel:
    """The controls; `server` connects them."""

    def __init__(self, server: viser.ViserServer, run: OpenedRun, motion: ToolMotion) -> None:
        gui = server.gui
        gui.set_panel_label(f"pentapod · {run.job.path.name}")
        gui.add_markdown(run_words(run))
        with gui.add_folder("Motion"):
            self.time = gui.add_slider("time, s", 0.0, motion.duration, motion.duration / SLIDER_STEPS, 0.0)
            self.play = gui.add_checkbox("play", initial_value=False)
            self.speed = gui.add_dropdown("speed", SPEEDS, initial_value="1 ×")
            self.machine_pose = gui.add_markdown("")
        with gui.add_folder("Placement"):
            self.reach = gui.add_markdown("")
            self.tilted = gui.add_checkbox(
                "best tool axis", initial_value=False,
                hint="Use the best tool axis within the job's cone at each waypoint, instead of the planned one",
            )  # fmt: skip
            self.tilted.disabled = run.job.axis.tilt_deg == 0.0
            self.place = gui.add_markdown("")
            self.back = gui.add_button("back to the plan")
        with gui.add_folder("Plan again"):
            self.replan = gui.add_button("plan with the part here")
            self.bar = gui.add_progress_bar(0.0, visible=False)
            self.news = gui.add_markdown("")

    @property
    def speed_factor(self) -> float:
        """Factor of the playback on the real speed."""
        return _FACTORS[self.speed.value]


def run_words(run: OpenedRun) -> str:
    """Return what the run is, as text."""
    whole = "" if run.piece is None else f"One of several set-ups, {run.piece}. "
    if run.program is None:
        return f"{whole}**Refused**: no program. Drag the part to where it fits."
    lines = [f"{whole}Component {run.component}, {duration(run.program.duration)}, {len(run.toolpath):,} waypoints."]
    if not run.same_job:
        lines.append("The job was changed after this program was made.")
    return " ".join(lines)


def reach_words(reach: Reach) -> str:
    """Return the margins of a placement, as text."""
    worst = reach.worst
    room = (
        f", {number(abs(worst.room), worst.unit)} {'beyond' if worst.room < 0.0 else 'to spare'}" if worst.unit else ""
    )
    answer = "**Fits.**" if reach.fits else f"**Does not fit** at {100.0 * reach.beyond:.1f} % of the path."
    return (
        f"{answer} Smallest margin {number(worst.margin)}: {worst.limit}{room}, at waypoint {worst.waypoint:,} "
        f"({len(reach.rows):,} judged)."
    )


def place_words(placement: RigidTransform) -> str:
    """Return position and rotation as in a job file."""
    position = ", ".join(f"{round(1e3 * value, 2) + 0.0:.2f}" for value in placement.translation.tolist())
    angles = ", ".join(f"{round(angle, 2) + 0.0:.2f}" for angle in rotation_angles_deg(placement.rotation))
    return f"position ({position}) mm, rotation ({angles}) deg".replace("-", "−")


def machine_pose_words(time: float, machine_pose: MachinePose) -> str:
    """Return the pose of the tool and the lengths of the legs; one beyond its stroke is bold."""
    tip = ", ".join(f"{1e3 * value:.1f}" for value in machine_pose.tip)
    legs = [f"{1e3 * length:.2f}" for length in machine_pose.legs]
    lengths = ", ".join(leg if fits else f"**{leg}!**" for leg, fits in zip(legs, machine_pose.within, strict=True))
    return f"{time:.2f} s, tip ({tip}) mm, legs {lengths} mm".replace("-", "−")
