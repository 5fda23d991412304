"""Contouring correction: errors of the pose become corrections of the leg commands, by internal model control.

A drive response a correction late and low-pass filtered, by known laws: its gains, period and dead time. So the
controller carries a model of the five drives with the corrections as the only input (an internal model, as in a Smith
predictor). The measured error less the model's motion is the disturbance; it is smoothed by a critically damped g-h
filter and extrapolated by its slope, and the leg commands are those that bring the model there in time: the state
feedback of a linear-quadratic regulator with cheap control, which inverts the drive as far as it can be inverted.

Source: M. Morari and E. Zafiriou, Robust Process Control, 1989 (internal model control); B. D. O. Anderson and J. B.
Moore, Optimal Control: Linear Quadratic Methods, 1990.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats
from pentapod.machine.drives import Drives

Feedback: TypeAlias = tuple[Floats, Floats, Floats, Floats, float]
"""Fields of `Correction`: state_matrix, input_vector, feedback_gain, prefilter and lead (2, 5), memory."""

_Complexes: TypeAlias = NDArray[np.complex128]


@dataclass(frozen=True)
class CorrectionOptions:
    """Options of the design of a correction."""

    effort: float = 1e-4
    """Weight of a metre of command against a metre of error: with less, the encoders' steps excite the drives.

    Infinite: no feedback of the model's state, the command is where the leg should be when the drive has followed it.
    """
    frequencies: int = 256
    """Frequencies at which the amplification is checked."""
    lowest_frequency: float = 1e-3
    """Lowest of these frequencies, radians in a controller period."""
    longest_memory: float = 1.0 - 1e-3
    """Largest memory that is tried."""
    halvings: int = 20
    """Bisections of the memory."""

    @property
    def circle(self) -> _Complexes:
        """Points e^{iω} (F,) on the unit circle at the frequencies."""
        return np.exp(1j * np.geomspace(self.lowest_frequency, np.pi, self.frequencies))


DEFAULTS = CorrectionOptions()


@dataclass(frozen=True, eq=False)
class Correction:
    """State feedback on models of five drives, sampled at the controller's period, n states each, metres and seconds.

    state_matrix (5, n, n), input_vector (5, n): the state one period later is matrix · state + vector · command; its
    first entry is the leg's position. feedback_gain (5, n), prefilter (5,): command = prefilter · wanted − gain · state
    brings the position to the wanted one, `lead` (5,) periods later. memory: of the filter, the share of the old
    estimate that is kept in a period.
    """

    state_matrix: Floats
    input_vector: Floats
    feedback_gain: Floats
    prefilter: Floats
    lead: Floats
    memory: float

    @property
    def feedback(self) -> Feedback:
        """The arguments of the compiled loop."""
        ends = np.stack([self.prefilter, self.lead])
        return self.state_matrix, self.input_vector, self.feedback_gain, ends, self.memory


NO_CORRECTION = Correction(np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1), np.zeros(1), 0.0)
"""For drives without correction."""


def steps_of(drives: Drives, period: float) -> tuple[int, int]:
    """Return how many periods of the drives there are in a controller period, and how many in their dead time."""
    parts = max(1, round(period / drives.period))
    return parts, round(drives.dead_time * parts / period)


def correction_for(
    drives: Drives, period: float, parts: int, delay: int, options: CorrectionOptions = DEFAULTS
) -> Correction | None:
    """Return the correction for drives with `parts` steps in a controller period and `delay` steps of dead time.

    Its memory is the shortest with which no frequency is amplified more than `drives.contour_margin` times, on any leg.
    None where there is none: drives that are unstable without correction, or a margin too close to 1.
    """
    gains = np.stack([drives.position_gain, drives.velocity_gain, drives.velocity_integral], axis=1)
    kinds, which = np.unique(gains, axis=0, return_inverse=True)
    which = which.reshape(-1)  # NumPy 2.0.0 keeps the axis
    designs = [_design(*_sampled(kind, period, parts, delay), options) for kind in kinds]
    found = [design for design in designs if design is not None]
    if len(found) < len(designs):
        return None
    *fields, response = (np.stack(columns) for columns in zip(*found, strict=True))
    memory = _memory(response, fields[-1], drives.contour_margin, options)
    if memory is None:
        return None
    matrix, vector, gain, prefilter, lead = (values[which] for values in fields)
    return Correction(matrix, vector, gain, prefilter, lead, memory)


_Design: TypeAlias = tuple[Floats, Floats, Floats, float, float, _Complexes]


def _design(matrix: Floats, vector: Floats, options: CorrectionOptions) -> _Design | None:
    """Return the first five fields of `Correction` for a drive, and its frequency response (F,).

    None for an unstable drive.
    """
    from scipy.linalg import solve_discrete_are  # noqa: PLC0415  slow to load

    if not np.abs(np.linalg.eigvals(matrix)).max() < 1.0:
        return None
    n, circle = len(matrix), options.circle
    position = np.eye(n)[0]
    gain = np.zeros(n)
    if np.isfinite(options.effort):
        cost = solve_discrete_are(matrix, vector[:, None], np.outer(position, position), np.array([[options.effort]]))
        gain = vector @ cost @ matrix / (options.effort + vector @ cost @ vector)
    closed = matrix - np.outer(vector, gain)
    static = np.linalg.solve(np.eye(n) - closed, vector)
    delayed = np.linalg.solve(np.eye(n) - closed, static)
    response = np.linalg.solve(circle[:, None, None] * np.eye(n) - closed, vector[:, None])[:, 0, 0]
    return matrix, vector, gain, 1.0 / static[0], delayed[0] / static[0], response / static[0]


def _memory(response: _Complexes, lead: Floats, margin: float, options: CorrectionOptions) -> float | None:
    """Return the shortest memory with which no frequency is amplified beyond the margin; response (K, F), lead (K,)."""
    circle = options.circle

    def amplification(memory: float) -> float:
        fresh, steep = 1.0 - memory * memory, (1.0 - memory) ** 2
        # Frequency responses of the g-h filter: position and slope of the disturbance.
        below = circle * circle - circle * (2.0 - fresh - steep) + (1.0 - fresh)
        place, slope = circle * (fresh * circle + steep - fresh), steep * circle * (circle - 1.0)
        return float(np.abs(1.0 - response * (place + lead[:, None] * slope) / below).max())

    short, long = 0.0, options.longest_memory
    if not amplification(long) <= margin:
        return None
    for _ in range(options.halvings):
        middle = 0.5 * (short + long)
        short, long = (short, middle) if amplification(middle) <= margin else (middle, long)
    return long


def _sampled(gains: Floats, period: float, parts: int, delay: int) -> tuple[Floats, Floats]:
    """Return state matrix (n, n) and input (n,) of a drive with gains (3,) over a controller period, command held.

    States: position, rate, position before, integral of the rate error, efforts within the dead time, newest first.
    """
    kp, kv, ki = gains
    dt, n = period / parts, 4 + delay
    step, command = np.zeros((n, n)), np.zeros(n)
    slow = np.zeros(n)
    slow[0], slow[2] = -kp - 1.0 / dt, 1.0 / dt
    effort = kv * (1.0 + ki * dt) * slow
    effort[3] += kv * ki
    moves = np.array([0.5 * dt * dt, dt])
    step[0, :2], step[1, 1], step[2, 0] = (1.0, dt), 1.0, 1.0
    if ki > 0.0:  # else the integral has no effect
        step[3], command[3] = dt * slow, dt * kp
        step[3, 3] += 1.0
    if delay:
        step[:2, -1] += moves
        first = 4  # of the efforts within the dead time
        step[first], command[first] = effort, kv * (1.0 + ki * dt) * kp
        step[first + 1 :, first:-1] = np.eye(delay - 1)
    else:
        step[:2] += np.outer(moves, effort)
        command[:2] = moves * kv * (1.0 + ki * dt) * kp
    matrix, vector = np.eye(n), np.zeros(n)
    for _ in range(parts):
        vector = step @ vector + command
        matrix = step @ matrix
    return matrix, vector
