"""CUTTERS: the tools by the names that job files use."""

from __future__ import annotations

from pentapod.base.errors import ToolpathError
from pentapod.base.registry import Registry

_HOMES = {
    "ball": "ball",
    "bull": "bull_nose",
    "flat": "flat_end",
    "lollipop": "lollipop",
    "standoff": "stand_off",
}
"""A new cutter is a file of this folder that ends with `CUTTER = TheClass`, and a line here."""

OWN_CUTTERS = tuple(_HOMES)

CUTTERS: Registry[type] = Registry(
    "type of tool",
    "pentapod.cutters",
    type,
    ToolpathError,
    homes={name: f"pentapod.cutters.{home}" for name, home in _HOMES.items()},
    constant="CUTTER",
)
