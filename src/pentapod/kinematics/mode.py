"""The assembly modes of a general linear pentapod: which root, and which of its two mirror images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch
from pentapod.base.errors import ArrayError


class Mode(NamedTuple):
    """order: −1 the first root, +1 the second; image: the sign of w, or of pz where w = 0. Each ±1.

    order is also the sign of the singularity polynomial (2), so no motion changes it without meeting a
    singularity. image names one of the poses (pz, w) and (−pz, −w) at an instant: w may pass through
    zero where nothing is singular, and then the image changes its name (see `follow`). Usable where an array
    (2,) is.
    """

    order: int
    image: int

    @property
    def w(self) -> int:
        """The sign of the direction's z component: the image."""
        return self.image

    def __str__(self) -> str:
        return "".join("+" if sign > 0 else "-" for sign in self)


MODES = (Mode(-1, 1), Mode(-1, -1), Mode(1, 1), Mode(1, -1))
"""In the order in which `GeneralPentapod.assembly_modes` returns them."""


def as_labels(value: ArrayLike, name: str, meaning: str) -> Floats:
    """Return labels (..., n) whose entries are +1, −1, or 0 and NaN for "no pose". Raises ArrayError for others."""
    labels = as_batch(value, name, ())
    known = np.isnan(labels) | (np.abs(labels) == 1.0) | (labels == 0.0)
    if not known.all():
        raise ArrayError(f"{name} is out of range", value=float(labels[~known][0]), expected=f"+1 or −1 {meaning}")
    return labels
