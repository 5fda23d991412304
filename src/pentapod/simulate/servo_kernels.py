"""The servo loop, compiled: drives at their own period, the pose and its correction at the controller's."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel
from pentapod.simulate.correction_kernels import Feedback, Known, contour, correct


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
    known: Known,
    out: Floats,
    efforts: Floats,
) -> None:
    """Fill leg lengths and accelerations of the drives, both (N, n_legs), at the rows; from rest at the first row.

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
            contour(alone, row, window, known, error)
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
