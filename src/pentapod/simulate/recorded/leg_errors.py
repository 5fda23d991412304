"""Errors of recorded legs, told apart: a constant offset, a wrong scale, a drift with time, and lag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value

MOST_ROWS = 40_000
"""Rows that are fitted at most, evenly taken."""

LEAST_RANGE_M = 1e-3
"""Travel of a leg below which its scale cannot be told."""

ROUNDS = 3
"""Rounds in which the lag is found."""

CUTOFF = 1e-7
"""Share of the largest singular value below which a combination of errors counts as not seen."""


@dataclass(frozen=True, eq=False)
class LegErrors(Value):
    """Errors of each leg (n_legs,): by least squares, off = offset + scale · length + drift · time − lag · rate.

    offset: metres, in the middle of the run and of the leg's travel; scale: metres a metre, NaN where the leg hardly
    moves; drift: m/s; lag: seconds, NaN where the run cannot be compared in time. rest: metres, root mean square of
    what these four leave. lag_is_absolute: whether the lag is against recorded commands; else against the run's start,
    which was found from the legs: what all legs lag alike is then not seen.
    """

    offset: Floats
    scale: Floats
    drift: Floats
    lag: Floats
    rest: Floats
    lag_is_absolute: bool

    @classmethod
    def of(
        cls, times: Floats, due: Floats, rates: Floats, off: Floats, *, in_time: bool, absolute: bool = False
    ) -> LegErrors:
        """Return the errors of legs that are off by `off` (n, n_legs) from where they are due, which moves by `rates`.

        in_time: whether `off` is taken at equal times; else at a place of the path, and what is along the path does
        not count.
        """
        some = slice(None, None, -(-len(times) // MOST_ROWS))
        t, bends = times[some] - float(times.mean()), np.gradient(rates, times, axis=0)[some]
        due, rates, off = due[some] - due.mean(axis=0), rates[some], off[some]
        kept = np.tile(np.eye(off.shape[1]), (len(t), 1, 1))
        if not in_time:
            speed = np.linalg.norm(rates, axis=1, keepdims=True)
            along = rates / np.where(speed > 0.0, speed, 1.0)
            kept -= along[:, :, None] * along[:, None, :]
        lag, values, left = np.zeros(off.shape[1]), off, off
        for _ in range(ROUNDS if in_time else 1):  # the rate changes while a leg lags
            late = -lag * rates + 0.5 * lag * lag * bends
            features = [np.ones_like(due), due + late, np.tile(t[:, None], len(lag))]
            features[1][:, np.ptp(due, axis=0) <= LEAST_RANGE_M] = 0.0
            features += [lag * bends - rates] if in_time else []
            values, left = _fitted(np.stack(features, axis=1), kept, off - late)
            lag = lag + values[3] if in_time else lag * np.nan
        rest = np.sqrt(np.square(left).mean(axis=0))
        return cls(values[0], values[1], values[2], lag, rest, absolute)

    def to_dict(self) -> dict[str, Any]:
        """Return the errors with their units in the names."""
        return {
            "offset_um": (1e6 * self.offset).tolist(),
            "scale_um_m": (1e6 * self.scale).tolist(),
            "drift_um_min": (60e6 * self.drift).tolist(),
            "lag_ms": (1e3 * self.lag).tolist(),
            "rest_um": (1e6 * self.rest).tolist(),
            "lag_is_absolute": self.lag_is_absolute,
        }

    def lines(self) -> list[str]:
        """Return a table, a line for each kind of error."""
        against = "against the commands" if self.lag_is_absolute else "against each other"
        rows = (
            ("offset, um", 1e6 * self.offset), ("scale, um/m", 1e6 * self.scale), ("drift, um/min", 60e6 * self.drift),
            (f"lag, ms, {against}", 1e3 * self.lag), ("rest, um rms", 1e6 * self.rest),
        )  # fmt: skip
        heads = "".join(f"{f'leg {k + 1}':>10}" for k in range(len(self.offset)))
        text = [f"  {'errors of the legs':<28}{heads}"]
        for name, values in rows:
            cells = "".join(f"{'-' if np.isnan(value) else f'{round(value, 4) + 0.0:.3g}':>10}" for value in values)
            text.append(f"  {name:<28}{cells}")
        return text


def _fitted(features: Floats, kept: Floats, off: Floats) -> tuple[Floats, Floats]:
    """Return factors (q, n_legs) of features (n, q, n_legs) and what they leave of `off` (n, n_legs).

    kept (n, n_legs, n_legs): projectors on what counts. NaN for features that are zero throughout.
    """
    size = np.sqrt(np.square(features).mean(axis=0))  # so that all unknowns count alike
    f = features / np.where(size > 0.0, size, 1.0)
    normal = np.einsum("iqk,ikl,ipl->qkpl", f, kept, f, optimize=True)
    right = np.einsum("iqk,ikl,il->qk", f, kept, off, optimize=True)
    found = np.linalg.pinv(normal.reshape(right.size, right.size), rcond=CUTOFF) @ right.ravel()
    found = found.reshape(right.shape)
    left = np.einsum("ikl,il->ik", kept, off - np.einsum("iqk,qk->ik", f, found))
    return np.where(size > 0.0, found / np.where(size > 0.0, size, 1.0), np.nan), left
