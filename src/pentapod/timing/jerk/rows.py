"""What limits a law with bounded jerk, at any stations."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from pentapod.base.arrays import Floats


@dataclass(frozen=True, eq=False)
class JerkRows:
    """What limits a law at gridpoints (N,): |first u + second x − offset| ≤ 1, |jerks (x, x′, x″)| √x ≤ 1, x ≤ ceiling.

    first, second (N, R); offset (N, R) or (1, R); jerks (N, K, 3): q‴, 1.5 q″ and 0.5 q′ over the limit; ceiling (N,).
    """

    first: Floats
    second: Floats
    offset: Floats
    jerks: Floats
    ceiling: Floats


_NONE = np.zeros((0, 0))
NO_ROWS = JerkRows(_NONE, _NONE, _NONE, np.zeros((0, 0, 3)), np.zeros(0))
ROW_NAMES = tuple(field.name for field in fields(JerkRows))


class RowsAt(Protocol):
    """Gives the rows at sorted stations (N,)."""

    def __call__(self, s: Floats) -> JerkRows: ...  # noqa: D102
