"""The table [tool] of a job file, made from its own keys and those of the cutters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, Field, SerializeAsAny, create_model

from pentapod.base.keys import VECTOR, Key, declared
from pentapod.base.tables import TomlTable, table_fields, table_of, wrong
from pentapod.cutters.registry import CUTTERS, OWN_CUTTERS


@dataclass(frozen=True, kw_only=True)
class ToolKeys:
    """The tool: a cutter that touches the surface, or a beam or spray that keeps its distance."""

    type: Annotated[
        str, Key("", '"ball", "bull" (nose), "flat" or "lollipop" cutter, or "standoff" (laser, spray, water jet)')
    ]
    shank: Annotated[
        tuple[VECTOR, ...] | None,
        Key(
            "mm",
            "shank or nozzle: [height, lower diameter, upper diameter] of each piece, upwards; without shank and "
            "holder a cutter has a stem of its own diameter up to the spindle",
        ),
    ] = None
    holder: Annotated[tuple[VECTOR, ...] | None, Key("mm", "holder: pieces as of the shank, above it")] = None
    length: Annotated[
        float | None, Key("mm", "from the platform's origin to the tip; the machine's if left out", gt=0.0, le=1000.0)
    ] = None

    @staticmethod
    def rules(table: Any) -> None:
        """Check the sizes that the type of cutter needs, and those that it does not take."""
        own = {item.file_key: item.is_needed for item in declared(CUTTERS[table.type])}
        needed = [key for key, is_needed in own.items() if is_needed]
        for key in _sizes(table.type):
            given = getattr(table, key) is not None
            if key in needed and not given:
                wrong(key, f'missing for a tool of type "{table.type}"', "a length in mm")
            if given and key not in own:
                wrong(key, f'means nothing for a tool of type "{table.type}"', f"{', '.join(needed)} alone")
        for key in ("shank_mm", "holder_mm"):
            for piece in getattr(table, key) or ():
                if piece[0] <= 0.0 or min(piece) < 0.0 or max(piece[1:]) <= 0.0:
                    wrong(key, "an impossible piece", "[height, lower diameter, upper diameter], all positive")


class ToolTable(TomlTable):
    """The table of a tool; its type says which sizes it has."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the given values, from which the model follows."""
        return _of_type, (self.model_dump(exclude_unset=True),)

    def sizes(self) -> dict[str, float]:
        """Return the sizes of the cutter that are given, by key, in mm."""
        values = {item.file_key: getattr(self, item.file_key) for item in declared(CUTTERS[self.type])}
        return {key: value for key, value in values.items() if value is not None}


def _sizes(kind: str) -> dict[str, Any]:
    """Return the sizes of all of pentapod's own cutters and of one more, by key, all of them optional."""
    cutters = [CUTTERS[name] for name in dict.fromkeys((*OWN_CUTTERS, kind))]
    fields = {key: field for cutter in reversed(cutters) for key, field in table_fields(cutter, optional=True).items()}
    return {item.file_key: fields[item.file_key] for cutter in cutters for item in declared(cutter)}


@cache
def tool_table(kind: str = "ball") -> type[ToolTable]:
    """Return the table [tool] for a type of tool; that of pentapod's own types is the same."""
    base = table_of(ToolKeys, ToolTable)
    types = Literal[tuple(dict.fromkeys((*OWN_CUTTERS, kind)))]
    field: Any = (types, Field(description=base.model_fields["type"].description))
    made: Any = create_model("ToolTable", __base__=base, __doc__=base.__doc__, type=field, **_sizes(kind))
    return made


def _of_type(value: Any) -> Any:
    """Validate [tool] by the sizes of its type."""
    if not isinstance(value, Mapping):
        return value
    kind = cast("Mapping[str, Any]", value).get("type")
    return tool_table(kind if isinstance(kind, str) and kind in CUTTERS else "ball").model_validate(value)


AnyTool = Annotated[SerializeAsAny[ToolTable], BeforeValidator(_of_type)]
