"""Scene: the machine, the part and the path as viser draws them, machine frame, metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.machine.clearance.collision_world import mounted
from pentapod.machine.leg_ends import arms_beside, base_rim, rails, strut_ends
from pentapod.report.decimate import thinned_mesh
from pentapod.report.drawings.colours import LIMIT_COLOUR, leg_colour
from pentapod.view.motion import MachinePose
from pentapod.view.opened_run import OpenedRun
from pentapod.view.shapes import along, quaternion, revolved, rotation_of, tool_mesh
from pentapod.view.study import Reach, Study

if TYPE_CHECKING:
    import viser

Rgb = tuple[int, int, int]

PART = "/part"
"""The node that is dragged, parent of mesh and path."""

MOST_FACETS = 120_000
LIFT_M = 0.5e-3
"""Shift of the path along the tool axis: a ball's tip runs on and below the surface."""

SHAFT_SHARE = 0.25
"""Radius of the shaft between tip and spindle, as a share of the spindle's."""

STEEL, DARK, PART_COLOUR, BEAM = (150, 156, 166), (84, 90, 100), (195, 206, 217), (224, 60, 40)


class ViewerScene:
    """One run in a viser scene. The part is dragged about its middle; all bodies of the tool move together."""

    def __init__(self, server: viser.ViserServer, run: OpenedRun, study: Study) -> None:
        self._server, self._run, self._study = server, run, study
        self._middle = run.mesh.bounds.mean(axis=0)
        api = server.scene
        self._set_up(server)
        size = float(np.ptp(run.mesh.bounds, axis=0).max())
        self.part = api.add_transform_controls(PART, scale=0.6 * size, depth_test=False, opacity=0.7, line_width=3.0)
        self.set_placement(run.placement)
        vertices, faces = thinned_mesh(run.mesh.vertices, run.mesh.faces, MOST_FACETS)
        api.add_mesh_simple(f"{PART}/mesh", vertices - self._middle, faces, color=PART_COLOUR, side="double")
        tips = run.toolpath.tips[study.shown] + LIFT_M * run.axes[study.shown] - self._middle
        grey = np.full((len(tips) - 1, 2, 3), 128, dtype=np.uint8)
        self._path = api.add_line_segments(
            f"{PART}/path", np.stack([tips[:-1], tips[1:]], axis=1), grey, thickness=3.5, thickness_units="screen"
        )
        self._add_base()
        self._tool = api.add_frame("/tool", show_axes=False)
        self._add_tool()
        radius = run.machine.bodies.leg_radius
        self._legs = [
            self._cylinder(f"/legs/{k + 1}", radius, _rgb(leg_colour(k))) for k in range(run.machine.robot.n_legs)
        ]
        self._beside, self._heights = arms_beside(run.machine)
        self._arms = [
            self._cylinder(f"/arms/{k + 1}", 0.6 * radius, _rgb(leg_colour(k))) for k in self._beside.tolist()
        ]
        limb = run.machine.limb
        self._strut = None if limb is None else self._cylinder("/limb/strut", limb.radius, STEEL)
        self._joints = [
            api.add_icosphere(f"/joints/{k + 1}", 1.6 * radius, color=_rgb(leg_colour(k)))
            for k in range(run.machine.robot.n_legs)
        ]

    @property
    def placement(self) -> RigidTransform:
        """The present placement, workpiece → machine."""
        rotation = rotation_of(np.asarray(self.part.wxyz, dtype=np.float64))
        position = np.asarray(self.part.position, dtype=np.float64)
        return RigidTransform(rotation, position - rotation @ self._middle)

    def set_placement(self, placement: RigidTransform) -> None:
        """Move the part to a placement."""
        self.part.wxyz = quaternion(placement.rotation)
        self.part.position = placement.apply(self._middle)

    def show_reach(self, reach: Reach) -> None:
        """Colour the path by its margins."""
        colours = reach.colours(self._study.shown)
        self._path.colors = np.stack([colours[:-1], colours[1:]], axis=1)

    def show_machine_pose(self, machine_pose: MachinePose) -> None:
        """Move legs and tool; a leg beyond its stroke is red."""
        with self._server.atomic():
            self._tool.position, self._tool.wxyz = machine_pose.tip, quaternion(along(machine_pose.axis))
            for k, leg in enumerate(self._legs):
                self._joints[k].position = machine_pose.joints[k]
                _stretch(leg, machine_pose.bases[k], machine_pose.joints[k])
                leg.color = _rgb(leg_colour(k) if machine_pose.within[k] else LIMIT_COLOUR)

            for arm, k, height in zip(self._arms, self._beside, self._heights, strict=True):
                _stretch(arm, machine_pose.tip + height * machine_pose.axis, machine_pose.joints[k])
            if self._strut is not None:
                _stretch(self._strut, *strut_ends(self._run.machine, machine_pose.tip, machine_pose.axis)[0])

    def _set_up(self, server: viser.ViserServer) -> None:
        """Set the camera: the work from the side, the base above it."""
        machine = self._run.machine
        centre, upward = machine.work.centre, -float(np.sign(machine.work.centre[2]) or 1.0)
        server.scene.set_up_direction((0.0, 0.0, upward))
        shown = np.vstack([machine.robot.base_joints, centre])
        middle = 0.5 * (shown.min(axis=0) + shown.max(axis=0))
        far = 2.1 * float(np.linalg.norm(shown - middle, axis=1).max())
        towards = np.array([-0.42, 0.88, -0.2 * upward])
        right = np.cross(towards, [0.0, 0.0, upward])
        camera = server.initial_camera
        camera.look_at = middle + 0.2 * far * right  # the panel covers the right
        camera.position = camera.look_at - far * towards
        camera.up = (0.0, 0.0, upward)

    def _add_base(self) -> None:
        base = self._run.machine.robot.base_joints
        rim = base_rim(self._run.machine, 97)
        rim = np.stack([rim[:-1], rim[1:]], axis=1)
        self._server.scene.add_line_segments("/base/rim", rim, DARK, thickness=3.0, thickness_units="screen")
        if self._run.machine.limb is not None:
            rail = rails(self._run.machine)
            self._server.scene.add_line_segments("/limb/rail", rail, DARK, thickness=5.0, thickness_units="screen")
        ball = 1.8 * self._run.machine.bodies.leg_radius
        for k, joint in enumerate(base):
            self._server.scene.add_icosphere(f"/base/{k + 1}", ball, color=_rgb(leg_colour(k)), position=joint)
            self._server.scene.add_label(f"/base/{k + 1}/name", f"{k + 1}")

    def _add_tool(self) -> None:
        """Everything that is fixed to the tool: spindle, rings outside it, shank and cutter, beam."""
        run, api = self._run, self._server.scene
        machine = run.machine
        heights = machine.tool_length - machine.robot.offsets
        top, nose = machine.tool_length - machine.line_top, machine.bodies.shaft_end
        self._cylinder("/tool/spindle", machine.bodies.shaft_radius, STEEL, nose, top)
        self._cylinder("/tool/shaft", SHAFT_SHARE * machine.bodies.shaft_radius, DARK, 0.0, nose)
        if isinstance(machine.robot, LegsOnRings):
            for k in np.flatnonzero(machine.robot.radii > machine.bodies.shaft_radius).tolist():
                rim = _circle(np.array([0.0, 0.0, heights[k]]), float(machine.robot.radii[k]))
                colour = _rgb(leg_colour(k))
                api.add_line_segments(f"/tool/ring{k + 1}", rim, colour, thickness=3.0, thickness_units="screen")
        cutter = [solid for solid in run.tool.solids if solid.kind == "cutter"]
        for name, solids, colour in (("cutter", cutter, DARK), ("body", mounted(run.tool.solids, machine), STEEL)):
            if solids:
                vertices, faces = tool_mesh(solids)
                api.add_mesh_simple(f"/tool/{name}", vertices, faces, color=colour)
        if run.tool.tilt_centre < 0.0:
            self._cylinder("/tool/beam", 0.4e-3, BEAM, run.tool.tilt_centre, 0.0)

    def _cylinder(self, name: str, radius: float, colour: Rgb, low: float = 0.0, high: float = 1.0) -> viser.MeshHandle:
        profile: Floats = np.array([[0.0, low], [radius, low], [radius, high], [0.0, high]])
        return self._server.scene.add_mesh_simple(name, *revolved(profile), color=colour)


def _stretch(cylinder: viser.MeshHandle, start: Floats, end: Floats) -> None:
    """Put a cylinder of unit length between two points (3,)."""
    way = end - start
    length = float(np.linalg.norm(way))
    cylinder.position, cylinder.wxyz, cylinder.scale = start, quaternion(along(way / length)), (1.0, 1.0, length)


def _circle(centre: Floats, radius: float) -> Floats:
    """Return the sides (96, 2, 3) of a circle square to z."""
    turn = np.linspace(0.0, 2.0 * np.pi, 97)
    rim = centre + radius * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    return np.stack([rim[:-1], rim[1:]], axis=1)


def _rgb(colour: str) -> Rgb:
    """Return the numbers of "#rrggbb"."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
