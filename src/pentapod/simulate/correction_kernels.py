"""The correction by the pose, compiled: how far the legs are from the path, and what they are told about it."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.forward.quadratic_kernels import poses
from pentapod.numerics.kernels import kernel

Known = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
"""How pose and path are found: linear_map (4, 5) and constant (4,) of `LinearPart`; geometry (7,): delta, x_3, y_3,
z_3, the limits of w² and S², tool length; component (1, 2) signs, base joints (n, 3), heights (n,), path
and path_directions (2N − 1, 3) at the rows and halfway."""

Feedback = tuple[Floats, Floats, Floats, Floats, float]
"""How errors are answered: model (5, n, n), push (5, n) and hold (5, n) of `Correction`; answers (2, 5): its answer and
lead; memory: share of what was known a period ago that is kept."""


@kernel
def contour(
    legs: Floats,
    row: int,
    window: int,
    known: Known,
    error: Floats,
) -> None:
    """Fill the leg lengths (5,), metres, that lead from a pose back onto the path; zeros where there is no pose.

    The pose is that of the legs as the encoders see them. Tip and direction of the path at the place nearest to
    it, among the `window` rows before this one, minus those of the pose; through the Jacobian. A turn counts as what it
    moves at the end of the tool: were the tip alone to choose the place, then where the tool turns nearly on the
    spot a hair's breadth of the tip would ask for another axis, whose correction moves the tip.
    """
    linear_map, constant, geometry, component, base, offsets, path, axes = known
    position, direction = np.empty((1, 3)), np.empty((1, 3))
    near = np.empty(1, dtype=np.bool_)
    poses(
        legs.reshape(1, -1), component, linear_map, constant, geometry[0], geometry[1:4], geometry[4:6],
        position, direction, near,
    )  # fmt: skip
    p, i, tool = position[0], direction[0], geometry[6]
    error[:] = 0.0
    if near[0] or not math.isfinite(p[0] + p[2] + i[2]):
        return
    best, at, fraction = np.inf, row, 0.0
    for k in range(max(0, row - window), min(row + 1, len(path) // 2)):
        along, square, away = 0.0, 0.0, 0.0
        for j in range(3):
            step, swing = path[2 * k + 2, j] - path[2 * k, j], tool * (axes[2 * k + 2, j] - axes[2 * k, j])
            along += step * (p[j] + tool * i[j] - path[2 * k, j]) + swing * tool * (i[j] - axes[2 * k, j])
            square += step * step + swing * swing
        along = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for j in range(3):
            step, swing = path[2 * k + 2, j] - path[2 * k, j], tool * (axes[2 * k + 2, j] - axes[2 * k, j])
            off = p[j] + tool * i[j] - path[2 * k, j] - along * step
            turned = tool * (i[j] - axes[2 * k, j]) - along * swing
            away += off * off + turned * turned
        if away <= best:
            best, at, fraction = away, k, along
    turn, move = np.empty(3), np.empty(3)
    # There the path is a parabola through three samples: chords of fast turns are micrometres off.
    first, last = (1.0 - fraction) * (1.0 - 2.0 * fraction), fraction * (2.0 * fraction - 1.0)
    middle = 4.0 * fraction * (1.0 - fraction)
    for j in range(3):
        to = first * path[2 * at, j] + middle * path[2 * at + 1, j] + last * path[2 * at + 2, j]
        turn[j] = first * axes[2 * at, j] + middle * axes[2 * at + 1, j] + last * axes[2 * at + 2, j] - i[j]
        move[j] = to - p[j] - tool * i[j] - tool * turn[j]
    for leg in range(len(error)):
        x = p[0] + offsets[leg] * i[0] - base[leg, 0]
        y = p[1] + offsets[leg] * i[1] - base[leg, 1]
        z = p[2] + offsets[leg] * i[2]
        length = math.sqrt(x * x + y * y + z * z)
        x, y, z = x / length, y / length, z / length
        error[leg] = (
            x * (move[0] + offsets[leg] * turn[0])
            + y * (move[1] + offsets[leg] * turn[1])
            + z * (move[2] + offsets[leg] * turn[2])
        )


@kernel
def correct(error: Floats, feedback: Feedback, state: Floats, trend: Floats, shift: Floats) -> None:
    """Fill the corrections of the leg commands (5,), metres, for one period; state and trend become those of the next.

    error (5,): of `contour`, for the legs as they would be without correction. state (5, n): of the models; its first
    numbers are what the correction has moved. trend (2, 5): of the errors, metres and metres in a period.
    """
    model, push, hold, answers, memory = feedback
    n = state.shape[1]
    later = np.empty(n)
    for leg in range(len(error)):
        expected = trend[0, leg] + trend[1, leg]
        off = error[leg] - expected
        trend[0, leg] = expected + (1.0 - memory * memory) * off
        trend[1, leg] += (1.0 - memory) ** 2 * off
        asked = answers[0, leg] * (trend[0, leg] + answers[1, leg] * trend[1, leg])
        for k in range(n):
            asked -= hold[leg, k] * state[leg, k]
        for k in range(n):
            later[k] = push[leg, k] * asked
            for j in range(n):
                later[k] += model[leg, k, j] * state[leg, j]
        shift[leg], state[leg] = asked, later
