"""Dynamics: what platform, legs and motors ask of the drives, as terms of a motion along a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, read_only
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.machine.rigid_bodies.capsules import leg_cylinder, leg_rod, spindle
from pentapod.machine.rigid_bodies.frames import ring_radii


@dataclass(frozen=True, eq=False)
class ForceTerms(Value):
    """Drive forces inertia · s̈ + quadratic · ṡ² + weight, (n, n_legs) each; a push is positive. No friction.

    inertia in kg, quadratic in kg/m (both for s in metres), weight in N. reach (n, n_legs): largest force of a leg that
    holds 1 N on the tip, by its direction.
    """

    inertia: Floats
    quadratic: Floats
    weight: Floats
    reach: Floats

    def forces(self, x: Floats, u: Floats) -> Floats:
        """Return the forces (n, n_legs), newtons, for x = ṡ² and u = s̈ (n,)."""
        return self.inertia * u[:, None] + self.quadratic * x[:, None] + self.weight


@dataclass(frozen=True, eq=False)
class Dynamics(Value):
    """Bodies of a machine whose legs end on the platform line or on rings around it, as moments of their masses.

    platform (3,), cylinders, rods (n_legs, 3): mass, first and second moment: of the platform about p along the line,
    of a cylinder about its base joint, of a rod about the platform joint. The tool's spin about the line is free.
    """

    machine: Machine
    platform: Floats
    cylinders: Floats
    rods: Floats

    @classmethod
    def of(cls, machine: Machine) -> Dynamics:
        """Return the bodies of a machine."""
        legs = range(machine.robot.n_legs)
        return cls(
            machine,
            np.array(spindle(machine, machine.line_top).moments),
            np.array([leg_cylinder(machine, leg).moments for leg in legs]),
            np.array([leg_rod(machine, leg).moments for leg in legs]),
        )

    def along(self, curve: Sequence[tuple[Floats, Floats]], *, reach: bool = True) -> ForceTerms:
        """Return the terms along a curve: tip and tool axis (n, 3), and their first and second derivatives by s."""
        tips, axes = (np.array([poses[k] for poses in curve[:3]]) for k in range(2))
        return self._terms(tips, axes, reach)

    def of_rows(
        self, position: Floats, direction: Floats, rates: Floats, accelerations: Floats, *, reach: bool = True
    ) -> ForceTerms:
        """Return the terms by time of legs (n, n_legs) that move so in poses (n, 3); their forces are those at x = 1.

        rates in m/s, accelerations in m/s².
        """
        from pentapod.machine.dynamics.dynamics_kernels import motion_of_rows  # noqa: PLC0415 - loads numba

        tips, axes = np.zeros((2, 3, len(position), 3))
        tips[0], axes[0] = position + self.machine.tool_length * direction, -direction
        motion_of_rows(read_only(rates), read_only(accelerations), *self._robot, tips, axes)
        return self._terms(tips, axes, reach)

    @property
    def _robot(self) -> tuple[Floats, Floats, Floats, float]:
        robot = self.machine.robot
        rings = read_only(ring_radii(robot))
        return read_only(robot.base_joints), read_only(robot.offsets), rings, self.machine.tool_length

    def _terms(self, tips: Floats, axes: Floats, asked: bool) -> ForceTerms:
        from pentapod.machine.dynamics.dynamics_kernels import force_terms  # noqa: PLC0415 - loads numba

        platform, cylinders, rods = read_only(self.platform), read_only(self.cylinders), read_only(self.rods)
        moving, gravity = read_only(self.machine.drives.moving_mass), read_only(self.machine.masses.gravity)
        count = tips.shape[1]
        terms, reach = np.empty((3, count, len(rods))), np.empty((count if asked else 0, len(rods)))
        force_terms(tips, axes, *self._robot, platform, cylinders, rods, moving, gravity, terms, reach)
        return ForceTerms(terms[0], terms[1], terms[2], reach)
