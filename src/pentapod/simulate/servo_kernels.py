"""The servo loop, compiled: drives at their own period, the pose and its correction at the controller's."""

from __future__ import annotations

import math

import numpy as np

from pentapod.arrays import Floats
from pentapod.compiled import kernel
from pentapod.kinematics.quadratic_kernels import poses

Known = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
"""How pose and path are found: linear_map (4, 5) and constant (4,) of `LinearPart`; geometry (7,): delta, x_3, y_3,
z_3, the squares of w and S near a singularity, tool length; component (1, 2) signs, base (5, 2), offsets (5,), path and
path_directions (N, 3) at the rows."""

_STANDING = 1e-8  # metres in a period: legs that are slower have no direction


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
    correction: Floats,
    known: Known,
    out: Floats,
    efforts: Floats,
) -> None:
    """Fill leg lengths and accelerations of the drives, both (N, 5), at the rows; from rest at the first row.

    lengths (N − 1, 5, 4), accelerations (N − 1, 5, 2): of `Reference`. parts: drive periods in a controller period;
    delay: drive periods of dead time. gains (3, 5): position loop, velocity loop and its integral, 1/s; shares (2,): of
    feed-forward. ripple (3, 5): amplitude m/s², pitch m, phase rad. correction (2,): gain and 1/s, zeros for none.
    """
    count, dt = len(lengths), period / parts
    window = min(count, int(3.0 / (gains[0].min() * period)) + 3)
    place, rate, seen = lengths[0, :, 0].copy(), np.zeros(5), lengths[0, :, 0].copy()
    if encoder_step > 0.0:
        for leg in range(5):
            seen[leg] = math.floor(place[leg] / encoder_step + 0.5) * encoder_step
    waiting, turn = np.zeros((delay + 1, 5)), 0
    held = np.zeros(5)
    shift, total, error = np.zeros(5), np.zeros(5), np.zeros(5)
    out[0], efforts[0] = place, 0.0
    for row in range(count):
        if correction[0] > 0.0 or correction[1] > 0.0:
            contour(seen, row, window, known, error)
            along, square = 0.0, 0.0
            for leg in range(5):
                total[leg] += correction[1] * period * error[leg]
                along += total[leg] * lengths[row, leg, 1]
                square += lengths[row, leg, 1] * lengths[row, leg, 1]
            # What was across the path before a turn is along it afterwards, where nothing would ever take it back.
            along = along / square if square > _STANDING * _STANDING else 0.0
            for leg in range(5):
                total[leg] -= along * lengths[row, leg, 1]
                shift[leg] = correction[0] * error[leg] + total[leg]
        for part in range(parts):
            t = part / parts
            for leg in range(5):
                c = lengths[row, leg]
                a = accelerations[row, leg]
                wanted = c[0] + t * (c[1] + t * (c[2] + t * c[3])) + shift[leg]
                wanted_rate = (c[1] + t * (2.0 * c[2] + 3.0 * t * c[3])) / period
                read = place[leg]
                if encoder_step > 0.0:
                    read = math.floor(read / encoder_step + 0.5) * encoder_step
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
    linear_map, constant, geometry, component, base, offsets, path, path_directions = known
    position, direction = np.empty((1, 3)), np.empty((1, 3))
    near = np.empty(1, dtype=np.bool_)
    poses(
        legs.reshape(1, 5), component, linear_map, constant, geometry[0], geometry[1:4], geometry[4:6],
        position, direction, near,
    )  # fmt: skip
    p, i, tool = position[0], direction[0], geometry[6]
    error[:] = 0.0
    if near[0] or not math.isfinite(p[0] + p[2] + i[2]):
        return
    best, at, fraction = np.inf, row, 0.0
    for k in range(max(0, row - window), min(row + 2, len(path) - 1)):
        along, square, away = 0.0, 0.0, 0.0
        for j in range(3):
            step, swing = path[k + 1, j] - path[k, j], tool * (path_directions[k + 1, j] - path_directions[k, j])
            along += step * (p[j] + tool * i[j] - path[k, j]) + swing * tool * (i[j] - path_directions[k, j])
            square += step * step + swing * swing
        along = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for j in range(3):
            step, swing = path[k + 1, j] - path[k, j], tool * (path_directions[k + 1, j] - path_directions[k, j])
            off = p[j] + tool * i[j] - path[k, j] - along * step
            turned = tool * (i[j] - path_directions[k, j]) - along * swing
            away += off * off + turned * turned
        if away <= best:
            best, at, fraction = away, k, along
    turn, move = np.empty(3), np.empty(3)
    for j in range(3):
        to = path[at, j] + fraction * (path[at + 1, j] - path[at, j])
        turn[j] = path_directions[at, j] + fraction * (path_directions[at + 1, j] - path_directions[at, j]) - i[j]
        move[j] = to - p[j] - tool * i[j] - tool * turn[j]
    for leg in range(5):
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
