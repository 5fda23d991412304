"""FAMILIES: the robot families by their names in `[geometry] family` of machine files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, cast

from pydantic import BeforeValidator, Field, SerializeAsAny

from pentapod.base.errors import InputError, MachineError
from pentapod.base.registry import Registry
from pentapod.base.tables import TomlTable, wrong
from pentapod.base.values import Value
from pentapod.kinematics.robot import Robot
from pentapod.machine.fields import FIVE_NUMBERS, FIVE_PAIRS

QUADRATIC, GENERAL = "quadratic", "general"


class GeometryTable(TomlTable):
    """Where the joints are. The quadratic family: delta, or platform_mm, or both if they agree; others: platform_mm."""

    family: str = Field(default=QUADRATIC, description="robot family: quadratic or general; packages can add others")
    base_mm: FIVE_PAIRS = Field(description="base joints [x, y] in the base plane z = 0, leg 1 to leg 5")
    delta: float | None = Field(default=None, description="platform joint i is at delta · x_i along the tool axis")
    platform_mm: FIVE_NUMBERS | None = Field(
        default=None, description="platform joints along the line towards the tip, leg 1 to leg 5"
    )


@dataclass(frozen=True)
class Family(Value):
    """A robot family in machine files.

    robot: table [geometry] → robot; `table.si` has the table's values in SI units. Raises MachineError where they make
    no robot. table: a subclass of `GeometryTable`, where the family has further keys.
    """

    robot: Callable[[Any], Robot]
    table: type[GeometryTable] = GeometryTable


FAMILIES = Registry(
    "robot family",
    "pentapod.families",
    Family,
    MachineError,
    homes={QUADRATIC: "pentapod.machine.quadratic", GENERAL: "pentapod.machine.general"},
    constant="FAMILY",
)
"""A new family of pentapod's own is a file with `FAMILY = Family(...)`, and its name here."""


def _of_family(value: Any) -> Any:
    """Validate [geometry] by the keys of its family."""
    if not isinstance(value, Mapping):
        return value
    table = cast("Mapping[str, Any]", value)
    try:
        model = FAMILIES.find(str(table.get("family", QUADRATIC))).table
    except InputError as error:
        wrong("family", error.what, error.expected, value=table["family"], remedy=error.remedy)
    return model.model_validate(table)


OfFamily = Annotated[SerializeAsAny[GeometryTable], BeforeValidator(_of_family)]
"""The table [geometry], with the keys of the family that it names."""
