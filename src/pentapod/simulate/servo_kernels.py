"""The servo loop, compiled: drives at their own period; pose and contouring correction at the controller's."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.forward.quadratic_kernels import poses
from pentapod.machine.dynamics.correction import Feedback
from pentapod.numerics.kernels import kernel

RobotAndPath = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
"""Robot and path: linear_map (4, 5) and constant (4,) of `LinearPart`; geometry (7,): delta, x_3, y_3,
z_3, the limits of w² and S², tool length; component (1, 2) signs, base joints (n, 3), heights (n,), path
and path_directions (2N − 1, 3) at the rows and halfway."""


@kernel
def contour(legs: Floats, row: int, window: int, robot_and_path: RobotAndPath, error: Floats) -> None:
    """Fill the changes of leg length (5,), metres, that bring a pose back onto the path; zeros where there is no pose.

    The pose is that of the encoders' leg lengths. Tip and direction of the path at its nearest point, among the
    `window` rows before this one, minus those of the pose are mapped by the Jacobian. A rotation counts as the motion
    of the tool's end: if the tip alone decided, a tiny motion of the tip would select another axis where the tool turns
    almost on the spot, and correcting that axis would move the tip.
    """
    linear_map, constant, geometry, component, base, offsets, path, axes = robot_and_path
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
        along, square, distance = 0.0, 0.0, 0.0  # distance: squared
        for j in range(3):
            step, swing = path[2 * k + 2, j] - path[2 * k, j], tool * (axes[2 * k + 2, j] - axes[2 * k, j])
            along += step * (p[j] + tool * i[j] - path[2 * k, j]) + swing * tool * (i[j] - axes[2 * k, j])
            square += step * step + swing * swing
        along = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for j in range(3):
            step, swing = path[2 * k + 2, j] - path[2 * k, j], tool * (axes[2 * k + 2, j] - axes[2 * k, j])
            deviation = p[j] + tool * i[j] - path[2 * k, j] - along * step
            turned = tool * (i[j] - axes[2 * k, j]) - along * swing
            distance += deviation * deviation + turned * turned
        if distance <= best:
            best, at, fraction = distance, k, along
    turn, move = np.empty(3), np.empty(3)
    # A parabola through three samples of the path: chords of fast turns would be micrometres deviation.
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
    """Fill the corrections of the leg commands (5,), metres, for one period, and advance state and trend by it.

    error (5,): of `contour`, for the legs without correction. state (5, n): of the models; its first column is the
    displacement by the correction. trend (2, 5): of the errors, metres and metres in a period.
    """
    matrix, vector, gain, prefilter_and_lead, memory = feedback
    n = state.shape[1]
    later = np.empty(n)
    for leg in range(len(error)):
        expected = trend[0, leg] + trend[1, leg]
        deviation = error[leg] - expected
        trend[0, leg] = expected + (1.0 - memory * memory) * deviation
        trend[1, leg] += (1.0 - memory) ** 2 * deviation
        wanted = trend[0, leg] + prefilter_and_lead[1, leg] * trend[1, leg]
        command = prefilter_and_lead[0, leg] * wanted
        for k in range(n):
            command -= gain[leg, k] * state[leg, k]
        for k in range(n):
            later[k] = vector[leg, k] * command
            for j in range(n):
                later[k] += matrix[leg, k, j] * state[leg, j]
        shift[leg], state[leg] = command, later


@kernel
def reading(place: float, step: float) -> float:
    """Return what an encoder with this resolution reads; 0 for none."""
    return math.floor(place / step + 0.5) * step if step > 0.0 else place


@kernel
def drive(
    lengths: Floats,
    accelerations: Floats,
    period: float,
    parts: int,
    delay: int,
    gains: Floats,
    shares: Floats,
    encoder_step: float,
    ripple: Floats,
    corrected: bool,
    feedback: Feedback,
    robot_and_path: RobotAndPath,
    out: Floats,
    efforts: Floats,
) -> None:
    """Fill leg lengths `out` and accelerations `efforts` of the drives, (N, n_legs), from rest at the first row.

    lengths (N − 1, n, 4), accelerations (N − 1, n, 2): of `Reference`. parts: drive periods in a controller period;
    delay: drive periods of dead time. gains (3, n): position loop, velocity loop and its integral, 1/s; shares (2,): of
    feed-forward. ripple (3, n_legs): amplitude m/s², pitch m, phase rad. corrected: whether to correct by the pose.
    """
    count, legs, dt = len(lengths), lengths.shape[1], period / parts
    window = min(count, int(max(1.0 - shares[0], 0.0) / (gains[0].min() * period)) + 1)
    place, rate, seen = lengths[0, :, 0].copy(), np.zeros(legs), np.zeros(legs)
    for leg in range(legs):
        seen[leg] = reading(place[leg], encoder_step)
    waiting, turn, held = np.zeros((delay + 1, legs)), 0, np.zeros(legs)
    shift, error, alone = np.zeros(legs), np.zeros(legs), np.zeros(legs)
    state, trend = np.zeros(feedback[1].shape), np.zeros((2, legs))
    out[0], efforts[0] = place, 0.0
    for row in range(count):
        if corrected:
            for leg in range(legs):
                alone[leg] = reading(place[leg], encoder_step) - state[leg, 0]
            contour(alone, row, window, robot_and_path, error)
            correct(error, feedback, state, trend, shift)
        for part in range(parts):
            t = part / parts
            for leg in range(legs):
                c = lengths[row, leg]
                a = accelerations[row, leg]
                wanted = c[0] + t * (c[1] + t * (c[2] + t * c[3])) + shift[leg]
                wanted_rate = (c[1] + t * (2.0 * c[2] + 3.0 * t * c[3])) / period
                read = reading(place[leg], encoder_step)
                slow = gains[0, leg] * (wanted - read) + shares[0] * wanted_rate - (read - seen[leg]) / dt
                held[leg] += dt * slow
                effort = gains[1, leg] * (slow + gains[2, leg] * held[leg]) + shares[1] * (a[0] + t * a[1])
                seen[leg] = read
                waiting[turn, leg] = effort
                effort = waiting[(turn + 1) % (delay + 1), leg]
                efforts[row + 1, leg] = effort
                effort -= ripple[0, leg] * math.sin(2.0 * math.pi * place[leg] / ripple[1, leg] + ripple[2, leg])
                place[leg] += dt * (rate[leg] + 0.5 * dt * effort)
                rate[leg] += dt * effort
            turn = (turn + 1) % (delay + 1)
        out[row + 1] = place
