"""The table [axis] of a job file: the nominal tool axis, and how far the tool may lean from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pentapod.base.keys import VECTOR, Key
from pentapod.base.tables import TomlTable, table_of, wrong
from pentapod.base.units import from_si, to_si
from pentapod.cutters.registry import CUTTERS
from pentapod.job.schema.strategies import FILE
from pentapod.toolpath.axis.orientation import Orientation

_AXIS_KEYS: dict[str, tuple[str, ...]] = {
    "normal": (),
    "auto": (),
    "fixed": ("direction",),
    "toward": ("point_mm",),
    "from": ("point_mm",),
    "between": ("places_mm", "directions"),
}
"""The keys that each mode of the nominal axis needs."""

WIDEST_CONE_DEG = 60.0
"""Largest half angle of the tilt cone around a nominal axis that is given."""


@dataclass(frozen=True, kw_only=True)
class AxisKeys:
    """Tool axis: nominal direction, tilt cone, lead and side angle, smoothing."""

    tilt: Annotated[
        float,
        Key(
            "deg",
            "largest angle between tool axis and nominal axis (the normal, unless mode says otherwise), at most 60; "
            "0 for bull and flat ends, also when left out; "
            'with mode "auto" from the normal, and when left out 90 for a ball, 15 for beams and sprays',
            ge=0.0,
            le=90.0,
        ),
    ] = to_si(15.0, "deg")
    mode: Annotated[
        Literal["normal", "auto", "fixed", "toward", "from", "between"],
        Key(
            "",
            'nominal axis: "normal"; "auto", between the normal and one direction that the planner chooses; "fixed"; '
            '"toward" or "from" a point or line; "between" given directions',
        ),
    ] = "normal"
    direction: Annotated[VECTOR | None, Key("", "fixed: from the tip to the spindle, mesh frame")] = None
    point: Annotated[VECTOR | None, Key("mm", "toward, from: a point, mesh frame")] = None
    line: Annotated[VECTOR | None, Key("", "toward, from: direction of a line through the point")] = None
    places: Annotated[tuple[VECTOR, ...] | None, Key("mm", "between: where the directions hold")] = None
    directions: Annotated[tuple[VECTOR, ...] | None, Key("", "between: one direction for each place")] = None

    @staticmethod
    def rules(table: Any) -> None:
        """Check the keys that a mode needs, and those that it does not take."""
        needed = _AXIS_KEYS[table.mode]
        for key in ("direction", "point_mm", "places_mm", "directions"):
            given = getattr(table, key) is not None
            if given != (key in needed):
                what = "missing for" if not given else "means nothing for"
                wrong(key, f'{what} axis mode "{table.mode}"', ", ".join(needed) or "none of these keys")
        if table.mode != "auto" and table.tilt_deg > WIDEST_CONE_DEG:
            wrong("tilt_deg", "too wide a cone", f'at most {WIDEST_CONE_DEG:g}, or mode = "auto"', value=table.tilt_deg)
        if table.line is not None and table.mode not in ("toward", "from"):
            wrong("line", f'means nothing for axis mode "{table.mode}"', 'mode = "toward" or "from"')
        for key in ("direction", "line"):
            if getattr(table, key) is not None and not any(getattr(table, key)):
                wrong(key, "the direction is zero", "a direction such as [0, 0, 1]")
        if table.places_mm is not None and len(table.places_mm) != len(table.directions or ()):
            wrong("directions", "as many directions as places are needed", f"{len(table.places_mm)} directions")


def by_default(axis: TomlTable, tilt_deg: float) -> TomlTable:
    """Return the table [axis] with a lean that counts as left out."""
    changed = axis.model_copy(update={"tilt_deg": tilt_deg})
    changed.model_fields_set.discard("tilt_deg")
    return changed


AxisTable = table_of(AxisKeys, TomlTable, Orientation)


def limited_lean(axis: TomlTable, tool: str, strategy: str) -> TomlTable:
    """Return the table [axis] of mode "auto" with the limit of the lean that suits a type of tool, if none is given.

    Raises the error of a rule for keys that do not go with the mode.
    """
    if strategy == FILE:
        own = 'mode = "normal", with tilt_deg around the axes of the file'
        wrong("axis.mode", "a toolpath from a file has axes of its own", own, value="auto")
    for key in ("lead_deg", "side_deg"):
        if getattr(axis, key):
            wrong(f"axis.{key}", 'means nothing for axis mode "auto"', '0, or mode = "normal"')
    most = float(from_si(CUTTERS[tool].largest_lean, "deg"))
    if "tilt_deg" not in axis.model_fields_set:
        return by_default(axis, most)
    if axis.tilt_deg > most:
        wrong("axis.tilt_deg", f'more than a tool of type "{tool}" may lean', f"at most {most:g}", value=axis.tilt_deg)
    return axis
