"""Claims about the component: proven in continuous time, for every interval between rows."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.kinematics.certificate import ComponentProof
from pentapod.verify.claim import Claim, Finding
from pentapod.verify.replay import Replay

_METHOD = (
    "component {component}; proven for all times: {what} by Bernstein coefficients of the discriminants of the "
    "forward kinematics, rounded outwards, even if each leg is off by {error:g} mm at any time"
)


def axis_upright(replay: Replay) -> Finding:
    """Judge that w keeps the sign of the component: the platform line never falls into the base plane."""
    proof = replay.proof
    angles = np.degrees(np.arcsin(np.minimum(proof.w_lower, 1.0)))
    return _finding(replay, angles, proof, "deg", "least angle between platform line and base plane,")


def off_singular_plane(replay: Replay) -> Finding:
    """Judge that S keeps the sign of the component: no configuration with det J = 0 because of S = 0."""
    proof = replay.proof
    # |S| / √(δ²w² + (1 − δu)²) is the distance to S = 0 at fixed orientation; the root is ≤ 1 + |δ|.
    distances = 1e3 * proof.s_lower / (1.0 + abs(replay.machine.pentapod.delta))
    return _finding(replay, distances, proof, "mm", "lower bound of the position's distance to S = 0,")


def _finding(replay: Replay, values: Floats, proof: ComponentProof, unit: str, what: str) -> Finding:
    worst = int(np.argmin(values))
    passed = bool((values > 0.0).all())
    where = replay.place(2 * worst)
    method = _METHOD.format(component=proof.component, what=what, error=1e3 * replay.path_tolerance)
    if not passed:
        method += f"; not proven on {int((values <= 0.0).sum())} of {len(values)} intervals"
    return Finding(passed, float(values[worst]), 0.0, unit, where, method)


CLAIMS = (
    Claim("component kept, w", axis_upright, needs_pose=False),
    Claim("component kept, S", off_singular_plane, needs_pose=False),
)
