"""Correction: how the error of the pose becomes a correction of the leg commands, by a model of the drives.

A drive follows a correction late and softened, by laws that are known: its gains, its period, its dead time. So the
controller carries a model of the five drives that is moved by the corrections alone (an internal model, as in a
Smith predictor). What is seen, less what the model says that the corrections have done, is what disturbs; it is
smoothed, carried forward by its slope, and the drives are asked for what makes the model stand there in time.

The leg commands answer quickly where the model lets them: they are the state feedback that a linear-quadratic regulator
with cheap control asks for. It inverts the drive where that can be inverted, and no gain has to be found by hand.

Source: M. Morari and E. Zafiriou, Robust Process Control, 1989 (internal model control); B. D. O. Anderson and J. B.
Moore, Optimal Control: Linear Quadratic Methods, 1990; the smoothing is the critically damped g-h filter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats
from pentapod.machine.drives import Drives

if TYPE_CHECKING:
    from pentapod.simulate.correction_kernels import Feedback

_Complexes: TypeAlias = NDArray[np.complex128]

_EFFORT = 1e-4  # weight of a metre of command against a metre of error: with less, the encoders' steps shake the drives
_TURNS = np.exp(1j * np.geomspace(1e-3, np.pi, 256))  # of the controller's periods: where margins are looked at
_HALVINGS = 20


@dataclass(frozen=True, eq=False)
class Correction:
    """State feedback on models of five drives, sampled at the controller's period, n states each, metres and seconds.

    model (5, n, n), push (5, n): the state one period later is model · state + push · command; its first number is the
    leg's place. hold (5, n), answer (5,): command = answer · wanted − hold · state brings the place to what is wanted.
    lead (5,): so many periods later it is there. memory: share of what was known a period ago that is kept.
    """

    model: Floats
    push: Floats
    hold: Floats
    answer: Floats
    lead: Floats
    memory: float

    @property
    def feedback(self) -> Feedback:
        """As the compiled loop takes it."""
        return self.model, self.push, self.hold, np.stack([self.answer, self.lead]), self.memory


NO_CORRECTION = Correction(np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1), np.zeros(1), 0.0)
"""For drives that are left alone."""


def correction_for(drives: Drives, period: float, parts: int, delay: int) -> Correction | None:
    """Return the correction for drives that take `parts` steps in a controller period and `delay` steps of dead time.

    Its memory is the shortest with which no frequency is enlarged more than `drives.contour_margin` times, on any leg.
    None where there is no such: drives that are not stable by themselves, or a margin too close to 1.
    """
    gains = np.stack([drives.position_gain, drives.velocity_gain, drives.velocity_integral], axis=1)
    kinds, which = np.unique(gains, axis=0, return_inverse=True)
    which = which.reshape(-1)  # NumPy 2.0.0 keeps the axis
    designs = [_design(*_sampled(kind, period, parts, delay)) for kind in kinds]
    found = [design for design in designs if design is not None]
    if len(found) < len(designs):
        return None
    model, push, hold, answer, lead, follows = (np.stack(parts) for parts in zip(*found, strict=True))
    memory = _memory(follows, lead, drives.contour_margin)
    if memory is None:
        return None
    return Correction(model[which], push[which], hold[which], answer[which], lead[which], memory)


_Design: TypeAlias = tuple[Floats, Floats, Floats, float, float, _Complexes]


def _design(model: Floats, push: Floats) -> _Design | None:
    """Return model, push, hold, answer and lead of `Correction` for a drive, and how place follows what is wanted (F,).

    None for a drive that is not stable.
    """
    from scipy.linalg import solve_discrete_are  # noqa: PLC0415  slow to load

    if not np.abs(np.linalg.eigvals(model)).max() < 1.0:
        return None
    n = len(model)
    place = np.eye(n)[0]
    cost = solve_discrete_are(model, push[:, None], np.outer(place, place), np.array([[_EFFORT]]))
    hold = push @ cost @ model / (_EFFORT + push @ cost @ push)
    closed = model - np.outer(push, hold)
    stands = np.linalg.solve(np.eye(n) - closed, push)
    late = np.linalg.solve(np.eye(n) - closed, stands)
    follows = np.linalg.solve(_TURNS[:, None, None] * np.eye(n) - closed, push[:, None])[:, 0, 0]
    return model, push, hold, 1.0 / stands[0], late[0] / stands[0], follows / stands[0]


def _memory(follows: _Complexes, lead: Floats, margin: float) -> float | None:
    """Return the shortest memory with which no frequency is enlarged beyond the margin; follows (K, F), lead (K,)."""

    def enlarged(memory: float) -> float:
        fresh, steep = 1.0 - memory * memory, (1.0 - memory) ** 2
        # The g-h filter: place and slope of what disturbs, from what is seen, at these frequencies.
        below = _TURNS * _TURNS - _TURNS * (2.0 - fresh - steep) + (1.0 - fresh)
        place, slope = _TURNS * (fresh * _TURNS + steep - fresh), steep * _TURNS * (_TURNS - 1.0)
        return float(np.abs(1.0 - follows * (place + lead[:, None] * slope) / below).max())

    short, long = 0.0, 1.0 - 1e-3
    if not enlarged(long) <= margin:
        return None
    for _ in range(_HALVINGS):
        middle = 0.5 * (short + long)
        short, long = (short, middle) if enlarged(middle) <= margin else (middle, long)
    return long


def _sampled(gains: Floats, period: float, parts: int, delay: int) -> tuple[Floats, Floats]:
    """Return the state matrix (n, n) and input (n,) of a drive with gains (3,), a controller period long, command held.

    States: place, rate, place before, integral of the rate error, efforts on their way, the newest first.
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
    if ki > 0.0:  # else nothing looks at the integral
        step[3], command[3] = dt * slow, dt * kp
        step[3, 3] += 1.0
    if delay:
        step[:2, -1] += moves
        first = 4  # of the efforts on their way
        step[first], command[first] = effort, kv * (1.0 + ki * dt) * kp
        step[first + 1 :, first:-1] = np.eye(delay - 1)
    else:
        step[:2] += np.outer(moves, effort)
        command[:2] = moves * kv * (1.0 + ki * dt) * kp
    whole, held = np.eye(n), np.zeros(n)
    for _ in range(parts):
        held = step @ held + command
        whole = step @ whole
    return whole, held
