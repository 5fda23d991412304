"""The table [tool] of a job file, made from the sizes that the cutters declare."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, Field, SerializeAsAny, create_model, model_validator

from pentapod.base.keys import declared
from pentapod.base.tables import Positive, Table, Vector, table_fields, wrong
from pentapod.cutters.registry import CUTTERS, OWN_CUTTERS


class ToolTable(Table):
    """The tool: a cutter that touches the surface, or a beam or spray that keeps its distance."""

    type: str = Field(
        description='"ball", "bull" (nose), "flat" or "lollipop" cutter, or "standoff" (laser, spray, water jet)'
    )
    shank_mm: tuple[Vector, ...] | None = Field(
        default=None, description="shank or nozzle: [height, lower diameter, upper diameter] of each piece, upwards"
    )
    holder_mm: tuple[Vector, ...] | None = Field(default=None, description="holder: pieces as of the shank, above it")
    length_mm: Positive | None = Field(
        default=None, le=1000.0, description="from the platform's origin to the tip; the machine's if left out"
    )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the given values; the model is made again from the cutters."""
        return _of_type, (self.model_dump(exclude_unset=True),)

    def sizes(self) -> dict[str, float]:
        """Return the sizes of the cutter that are given, by key, in mm."""
        values = {item.file_key: getattr(self, item.file_key) for item in declared(CUTTERS[self.type])}
        return {key: value for key, value in values.items() if value is not None}

    @model_validator(mode="after")
    def _own_size(self) -> ToolTable:
        own = {item.file_key: item.is_needed for item in declared(CUTTERS[self.type])}
        needed = [key for key, is_needed in own.items() if is_needed]
        for key in _sizes(self.type):
            given = getattr(self, key) is not None
            if key in needed and not given:
                wrong(key, f'missing for a tool of type "{self.type}"', "a length in mm")
            if given and key not in own:
                wrong(key, f'means nothing for a tool of type "{self.type}"', f"{', '.join(needed)} alone")
        for key in ("shank_mm", "holder_mm"):
            for piece in getattr(self, key) or ():
                if piece[0] <= 0.0 or min(piece) < 0.0 or max(piece[1:]) <= 0.0:
                    wrong(key, "an impossible piece", "[height, lower diameter, upper diameter], all positive")
        return self


def _sizes(kind: str) -> dict[str, Any]:
    """Return the sizes of all of pentapod's own cutters and of one more, by key, all of them optional."""
    cutters = [CUTTERS[name] for name in dict.fromkeys((*OWN_CUTTERS, kind))]
    fields = {key: field for cutter in reversed(cutters) for key, field in table_fields(cutter, optional=True).items()}
    return {item.file_key: fields[item.file_key] for cutter in cutters for item in declared(cutter)}


@cache
def tool_table(kind: str = "ball") -> type[ToolTable]:
    """Return the table [tool] for a type of tool; that of pentapod's own types is the same."""
    about = ToolTable.model_fields["type"].description
    types: Any = (Literal[tuple(dict.fromkeys((*OWN_CUTTERS, kind)))], Field(description=about))
    return create_model("ToolTable", __base__=ToolTable, __doc__=ToolTable.__doc__, type=types, **_sizes(kind))


def _of_type(value: Any) -> Any:
    """Validate [tool] by the sizes of its type."""
    if not isinstance(value, Mapping):
        return value
    kind = cast("Mapping[str, Any]", value).get("type")
    return tool_table(kind if isinstance(kind, str) and kind in CUTTERS else "ball").model_validate(value)


AnyTool = Annotated[SerializeAsAny[ToolTable], BeforeValidator(_of_type)]
