"""Observations: residuals of measurements and their derivatives by the thirty numbers of a machine.

Residuals are scaled so that the legs' errors alone would give them the covariance σ² 1; those of the instrument add the
covariance `instrument_covariances`. What an instrument sees of a pose is compared with

- the readings that the machine would have there, where the pose is seen as a whole (m = 5 numbers of a pose);
- the target of the pose that the readings give, where its position (m = 3) or its distance (m = 1) is seen.

In the second case further unknowns are where the ball stands, and how the instrument's later set-ups stand to the
first; a first set-up in a frame of its own is laid on the nominal machine as well as it fits: the frame is free.
"""

from __future__ import annotations

import dataclasses
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.machine.calibration.parameters import PARAMETERS
from pentapod.machine.identification.alignment import ball_centre, rigid_motion
from pentapod.machine.identification.measurements import Frame, Instrument, Measurements
from pentapod.machine.identification.sensitivity import (
    by_parameters,
    machine_of,
    numbers_of,
    poses_near,
    spread,
    tip_by_legs,
)

FRAME_KINDS = ("shift x", "shift y", "shift z", "turn x", "turn y", "turn z")


class Observations(Protocol):
    """What a fit asks of measurements. Unknowns are the thirty numbers, then `extras`."""

    extras: tuple[str, ...]
    """Names of the further unknowns."""

    start: Floats
    """First values of all unknowns."""

    instrument_covariances: Floats
    """Of the scaled residuals (N, m, m), m²: those that the instrument's errors alone would give."""

    longest: float
    """The longest reading, metres: what rounding errors are a share of."""

    def residuals(self, theta: Floats) -> Floats:
        """Return the scaled residuals (N, m), metres: as measured minus as computed."""
        ...

    def columns(self, theta: Floats) -> Floats:
        """Return how what is computed changes with the unknowns (N, m, 30 + extras)."""
        ...

    def in_legs(self, residuals: Floats) -> Floats:
        """Return the smallest errors of readings (N, 5) that would explain scaled residuals, metres."""
        ...

    def off(self, residual: Floats, pose: int) -> float:
        """Return how far off the target is where a pose has this scaled residual (m,); of distances: their error."""
        ...


class PoseObservations:
    """Poses that are seen as a whole: positions p, unit directions i (N, 3), readings (N, 5)."""

    extras: tuple[str, ...] = ()

    def __init__(
        self,
        p: Floats,
        i: Floats,
        readings: Floats,
        machine: AsBuiltPentapod,
        s_p: float,
        s_i: float,
        target: float = 0.0,
    ) -> None:
        self.p, self.i, self.readings, self.machine, self.target = p, i, readings, machine, target
        self.start, self.longest = numbers_of(machine), float(np.abs(readings).max())
        jacobian = machine.jacobian(p, i)
        by_p, by_i = jacobian[..., :3], jacobian[..., 3:]
        by_i = by_i - np.einsum("nkc,nc->nk", by_i, i)[..., None] * i[:, None]
        self.instrument_covariances = s_p**2 * by_p @ by_p.swapaxes(1, 2) + s_i**2 * by_i @ by_i.swapaxes(1, 2)

    def residuals(self, theta: Floats) -> Floats:
        """Return the readings minus those of the machine in the poses that were seen."""
        return self.readings - machine_of(theta).leg_lengths(self.p, self.i)

    def columns(self, theta: Floats) -> Floats:
        """Return ∂readings/∂parameters (N, 5, 30)."""
        return spread(by_parameters(machine_of(theta), self.p, self.i))

    def in_legs(self, residuals: Floats) -> Floats:
        """Return the residuals: they are errors of readings."""
        return residuals

    def off(self, residual: Floats, pose: int) -> float:
        """Return how far such errors of the readings (5,) take the target."""
        by_legs = tip_by_legs(self.machine, self.p[pose : pose + 1], self.i[pose : pose + 1], self.target)[0]
        return float(np.linalg.norm(by_legs @ residual))


class TargetObservations:
    """The target's positions, or distances, against those of the poses that the readings give."""

    def __init__(self, measured: Measurements, machine: AsBuiltPentapod) -> None:
        """Raise ArrayError where readings have no pose of the machine."""
        self.measured, self.machine, self.seen = measured, machine, np.array(measured.seen)
        self.poses = start_poses(measured, machine)
        self.longest = float(np.abs(measured.legs).max())
        self.distances = measured.instrument is Instrument.BALLBAR
        targets, count = self.poses[0] + measured.target * self.poses[1], int(measured.setups.max()) + 1
        firsts, names = list[Floats](), list[str]()
        if self.distances:
            for setup in range(count):
                rows = measured.setups == setup
                firsts.append(ball_centre(targets[rows], measured.seen[rows, 0]))
                names += [f"ball {setup + 1} {axis}" for axis in "xyz"]
        else:
            for setup in range(1, count):
                firsts.append(np.zeros(len(FRAME_KINDS)))
                names += [f"set-up {setup + 1} {kind}" for kind in FRAME_KINDS]
        self.extras = tuple(names)
        self.start = np.concatenate([numbers_of(machine), *firsts])
        by_legs = self._by_target(self.start) @ tip_by_legs(machine, *self.poses, measured.target)
        self.scale = np.asarray(np.linalg.inv(np.linalg.cholesky(by_legs @ by_legs.swapaxes(1, 2))), dtype=np.float64)
        self.by_legs = self.scale @ by_legs  # orthonormal rows
        self.instrument_covariances = measured.position_sigma**2 * self.scale @ self.scale.swapaxes(1, 2)

    def residuals(self, theta: Floats) -> Floats:
        """Return the scaled residuals (N, m)."""
        return (self.scale @ self.unscaled(theta)[..., None])[..., 0]

    def unscaled(self, theta: Floats) -> Floats:
        """Return positions or distances as measured minus as computed (N, 3 or 1), metres."""
        targets = self._targets(theta)
        if self.distances:
            return self.measured.seen - np.linalg.norm(targets - self._centres(theta), axis=1)[:, None]
        shift, turned = self._turned(theta)
        return turned + shift - targets

    def columns(self, theta: Floats) -> Floats:
        """Return how what is computed changes with the unknowns (N, m, 30 + extras)."""
        self._targets(theta)
        geometry, target = machine_of(theta), self.measured.target
        by_theta = -tip_by_legs(geometry, *self.poses, target) @ spread(by_parameters(geometry, *self.poses))
        by_target = self._by_target(theta)
        own = np.zeros((len(self.measured), by_target.shape[1], len(self.extras)))
        for setup in range(int(self.measured.setups.max()) + 1):
            rows = self.measured.setups == setup
            if self.distances:
                own[rows, :, 3 * setup : 3 * setup + 3] = -by_target[rows]
            elif setup:
                first = len(FRAME_KINDS) * (setup - 1)
                own[rows, :, first : first + 3] = -np.eye(3)
                own[rows, :, first + 3 : first + 6] = _cross(self._turned(theta)[1][rows])
        return self.scale @ np.concatenate([by_target @ by_theta, own], axis=-1)

    def in_legs(self, residuals: Floats) -> Floats:
        """Return the smallest errors of readings (N, 5) that would explain scaled residuals."""
        return -np.einsum("nmk,nm->nk", self.by_legs, residuals)

    def off(self, residual: Floats, pose: int) -> float:
        """Return the distance, or the error of the distance, that a scaled residual stands for."""
        return float(np.linalg.norm(np.linalg.solve(self.scale[pose], residual)))

    def _targets(self, theta: Floats) -> Floats:
        """Return the targets (N, 3) of the poses that the readings give, and keep these poses."""
        p, i = poses_near(machine_of(theta), self.measured.legs, *self.poses)
        lost = np.isnan(p[:, 0])
        self.poses = np.where(lost[:, None], self.poses[0], p), np.where(lost[:, None], self.poses[1], i)
        return np.where(lost[:, None], np.inf, p + self.measured.target * i)

    def _centres(self, theta: Floats) -> Floats:
        return theta[len(PARAMETERS) :].reshape(-1, 3)[self.measured.setups]

    def _turned(self, theta: Floats) -> tuple[Floats, Floats]:
        """Return the shifts (N, 3) of the set-ups' frames, and the positions (N, 3) turned with them."""
        moves = np.vstack([np.zeros((1, 6)), theta[len(PARAMETERS) :].reshape(-1, 6)])[self.measured.setups]
        return moves[:, :3], Rotation.from_rotvec(moves[:, 3:]).apply(self.seen)

    def _by_target(self, theta: Floats) -> Floats:
        """Return ∂computed/∂target (N, m, 3)."""
        if not self.distances:
            return np.broadcast_to(np.eye(3), (len(self.measured), 3, 3))
        away = self.poses[0] + self.measured.target * self.poses[1] - self._centres(theta)
        return (away / np.linalg.norm(away, axis=1, keepdims=True))[:, None]


def observations_of(measured: Measurements, machine: AsBuiltPentapod) -> PoseObservations | TargetObservations:
    """Return the observations of measurements `in_machine_frame`; machine: where the fit starts. Raises ArrayError."""
    if not measured.instrument.sees_axes:
        return TargetObservations(measured, machine)
    positions, direction = measured.seen[:, :3], -measured.seen[:, 3:]
    sigmas = (measured.position_sigma, measured.direction_sigma)
    return PoseObservations(
        positions - measured.target * direction, direction, measured.legs, machine, *sigmas, measured.target
    )


def start_poses(measured: Measurements, machine: AsBuiltPentapod) -> tuple[Floats, Floats]:
    """Return the poses (N, 3) that readings would have on the machine. Raises ArrayError where there is none."""
    if machine.nominal is None:
        raise ArrayError("positions alone need a machine that knows its nominal geometry", key="nominal")
    p, i = machine.nominal.pose(measured.legs - machine.zeros, measured.component)
    p, i = poses_near(machine, measured.legs, p, i)
    if np.isnan(p).any():
        pose = int(np.argmax(np.isnan(p).any(axis=1)))
        raise ArrayError(
            f"line {measured.lines[pose]}: the machine has no pose with these legs in component {measured.component}",
            key="legs",
            value=(np.round(1e3 * measured.legs[pose], 3)).tolist(),
            expected="readings in mm, leg 1 to leg 5, of this machine",
        )
    return p, i


def in_machine_frame(measured: Measurements, machine: AsBuiltPentapod) -> Measurements:
    """Return measurements with what was seen laid on the machine's poses, where it is in other frames.

    A first set-up in the machine's frame stays. Raises ArrayError: readings without a pose, too few positions.
    """
    if measured.instrument is Instrument.BALLBAR or (measured.frame is Frame.MACHINE and not measured.setups.any()):
        return measured
    p, i = start_poses(measured, machine)
    targets, seen = p + measured.target * i, np.array(measured.seen)
    for setup in range(int(measured.setups.max()) + 1):
        rows = measured.setups == setup
        if setup or measured.frame is Frame.INSTRUMENT:
            motion = rigid_motion(seen[rows, :3], targets[rows])
            seen[rows] = np.hstack(
                [motion.apply(seen[rows, :3]), motion.rotate(seen[rows, 3:])]
                if seen.shape[1] > 3
                else [motion.apply(seen[rows])]
            )
    return dataclasses.replace(measured, seen=seen, frame=Frame.MACHINE)


def _cross(vectors: Floats) -> Floats:
    """Return the matrices (N, 3, 3) of v × ·."""
    x, y, z = vectors.T
    nothing = np.zeros_like(x)
    return np.stack([nothing, -z, y, z, nothing, -x, -y, x, nothing], axis=-1).reshape(-1, 3, 3)
