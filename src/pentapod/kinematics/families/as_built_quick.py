"""Forward kinematics of machines as built, in microseconds a pose: for the rows of programs (lemma 16)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, as_batch, read_only
from pentapod.base.errors import ArrayError
from pentapod.kinematics.batches import broadcast
from pentapod.kinematics.families.as_built_forward import Nominal
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.proofs.chords import kernel_geometry
from pentapod.kinematics.tubes.leg_equations import BuiltLegs, length_scale

HALVINGS = 4
"""How often the way from the nominal geometry to the real one may be halved."""


def quick_poses(
    machine: BuiltLegs, nominal: Nominal, legs: ArrayLike, component: ArrayLike
) -> tuple[Floats, Floats, Bools]:
    """Return positions and directions (..., 3) of leg readings (..., 5), and where (...) the pose is proven.

    Proven: there is a pose within 1e-7 of the one given (in practice 1e-11) with these readings, the nominal machine is
    in the component in this pose, and on the straight way from the nominal geometry to the real one, the pose held, no
    singularity is met. Raises ArrayError as `as_built_pose`.
    """
    from pentapod.kinematics.proofs.built_kernels import built_poses  # noqa: PLC0415 - loads numba

    readings, signs = as_batch(legs, "legs", (5,)), as_batch(component, "component", (2,))
    if not (np.isnan(readings) | ((readings > 0.0) & np.isfinite(readings))).all():
        raise ArrayError("legs must be finite and positive", expected="metres, NaN where there is no reading")
    readings, signs = broadcast(readings, signs, ("legs", "component"))
    batch, signs = readings.shape[:-1], np.ascontiguousarray(signs.reshape(-1, 2), dtype=np.float64)
    lengths = readings.reshape(-1, 5) - machine.zeros
    lengths = np.where((lengths > 0.0).all(axis=-1, keepdims=True), lengths, np.nan)
    poses = np.concatenate(nominal.pose(lengths, signs), axis=-1)
    order = np.zeros(len(signs)) if isinstance(nominal, LinearPentapod) else np.ascontiguousarray(signs[:, 0])
    proven = np.zeros(len(poses), dtype=np.bool_)
    stages = _stages(machine, nominal, lengths)
    fixed = read_only(signs), read_only(order)
    built_poses(np.ascontiguousarray(lengths), poses, *stages, *fixed, length_scale(machine), proven)
    return poses[:, :3].reshape(*batch, 3), poses[:, 3:].reshape(*batch, 3), proven.reshape(batch)


def _stages(machine: BuiltLegs, nominal: Nominal, lengths: Floats) -> tuple[Floats, Floats, Floats]:
    """Return stages, ring_stages and shift as `built_poses` takes them."""
    real = np.column_stack([machine.base_joints, machine.offsets, machine.radii])
    design = np.column_stack([nominal.base_joints, nominal.offsets, nominal.radii])
    middles = [(2 * n + 1) / 2 ** (k + 1) for k in range(HALVINGS + 1) for n in range(2**k)]
    last = np.maximum(kernel_geometry(machine, lengths)[5], kernel_geometry(nominal, lengths)[5])
    if isinstance(nominal, LinearPentapod):
        last[:2] = nominal.delta, nominal.lever
    ways = [1.0, *middles, 0.0]
    stages, rings = np.empty((len(ways), 6, 4)), np.zeros((len(ways), 5, 9))
    for k, s in enumerate(ways):
        here = real if s == 1.0 else design + s * (real - design)
        stages[k, :5], stages[k, 5], rings[k, :, 8] = here[:, :4], last, here[:, 4]
    return stages, rings, real - design
