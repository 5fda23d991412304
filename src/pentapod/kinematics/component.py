"""The four components of the configuration space of the quadratic family."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from pentapod.base.arrays import as_batch
from pentapod.base.errors import ArrayError


class Component(NamedTuple):
    """The signs of w and of S (kinematics notes, section 4): each ±1. Usable where an array (2,) is.

    >>> Component.parse("+-")
    Component(w=1, s=-1)
    >>> str(Component(1, -1))
    '+-'
    """

    w: int
    s: int

    def __str__(self) -> str:
        return "".join("+" if sign > 0 else "-" for sign in self)

    @classmethod
    def parse(cls, name: str) -> Component:
        """Return the component named "++", "+-", "-+" or "--" (sign of w, sign of S). Raises ArrayError."""
        for component in COMPONENTS:
            if str(component) == name:
                return component
        raise ArrayError("unknown component", value=name, expected='"++", "+-", "-+" or "--" (signs of w and S)')


COMPONENTS = (Component(1, 1), Component(1, -1), Component(-1, 1), Component(-1, -1))
"""In the order of the assembly modes that `LinearPentapod.assembly_modes` returns."""


def as_component(value: ArrayLike) -> Component:
    """Return the component that one pair of signs (2,) names. Raises ArrayError."""
    signs = as_batch(value, "component", (2,))
    for component in COMPONENTS:
        if signs.shape == (2,) and tuple(signs) == component:
            return component
    raise ArrayError("component must be one pair of signs", value=signs.tolist(), expected="+1 or −1 for w and for S")
