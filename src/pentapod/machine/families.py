"""FAMILIES: the robot families by their names in `[geometry] family` of machine files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, cast

from pydantic import BeforeValidator, Field, SerializeAsAny, ValidationInfo

from pentapod.base.errors import InputError, MachineError
from pentapod.base.registry import Registry
from pentapod.base.tables import TomlTable, wrong
from pentapod.base.values import Value
from pentapod.kinematics.robot import Robot
from pentapod.machine.bars import PassiveLimb
from pentapod.machine.fields import LEG_NUMBERS, LEG_PAIRS, LEGS

QUADRATIC, GENERAL, PENTAKINS, HEXA, SPR, PRPU = "quadratic", "general", "pentakins", "hexa", "4-ups-spr", "5-ups-prpu"


class GeometryTable(TomlTable):
    """Where the joints are. The quadratic family: delta, or platform_mm, or both if they agree; others: platform_mm."""

    family: str = Field(
        default=QUADRATIC,
        description="robot family: quadratic, general, pentakins, hexa, 4-ups-spr or 5-ups-prpu; packages add others",
    )
    base_mm: LEG_PAIRS = Field(description="base joints [x, y] in the base plane z = 0, leg by leg")
    delta: float | None = Field(default=None, description="platform joint i is at delta · x_i along the tool axis")
    platform_mm: LEG_NUMBERS | None = Field(
        default=None, description="platform joints along the line towards the tip, leg by leg"
    )


@dataclass(frozen=True)
class Family(Value):
    """A robot family in machine files.

    robot: table [geometry] → robot; `table.si` has the table's values in SI units. Raises MachineError where they make
    no robot. table: a subclass of `GeometryTable`, where the family has further keys. n_legs: lists with a value for
    each leg have so many. limb: table [geometry] → passive limb, where the robot has one.
    """

    robot: Callable[[Any], Robot]
    table: type[GeometryTable] = GeometryTable
    n_legs: int = LEGS
    limb: Callable[[Any], PassiveLimb] | None = None


FAMILIES = Registry(
    "robot family",
    "pentapod.families",
    Family,
    MachineError,
    homes={
        QUADRATIC: "pentapod.machine.robots.quadratic",
        GENERAL: "pentapod.machine.robots.general",
        PENTAKINS: "pentapod.machine.robots.pentakins",
        HEXA: "pentapod.machine.robots.hexa",
        SPR: "pentapod.machine.robots.spr",
        PRPU: "pentapod.machine.robots.prpu",
    },
    constant="FAMILY",
)
"""A new family of pentapod's own is a file with `FAMILY = Family(...)`, and its name here."""


def _of_family(value: Any, info: ValidationInfo) -> Any:
    """Validate [geometry] by the keys of its family."""
    if not isinstance(value, Mapping):
        return value
    table = cast("Mapping[str, Any]", value)
    try:
        model = FAMILIES.find(str(table.get("family", QUADRATIC))).table
    except InputError as error:
        wrong("family", error.what, error.expected, value=table["family"], remedy=error.remedy)
    return model.model_validate(table, context=info.context)


def legs_of(content: Mapping[str, Any]) -> int:
    """Return how many legs the machine of a file's content has; those of the quadratic family where it is unclear."""
    geometry: Any = content.get("geometry")
    try:
        return FAMILIES.find(str(cast("Mapping[str, Any]", geometry).get("family", QUADRATIC))).n_legs
    except (InputError, AttributeError):  # told when [geometry] is read
        return LEGS


OfFamily = Annotated[SerializeAsAny[GeometryTable], BeforeValidator(_of_family)]
"""The table [geometry], with the keys of the family that it names."""
