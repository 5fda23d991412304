"""Keys of [placement] and [fixture]: where the part stands, and what holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pentapod.base.keys import VECTOR, Key
from pentapod.base.tables import table_of, wrong
from pentapod.mesh.io.registry import states_unit

Pose = tuple[float, float, float, float, float, float]
Row = tuple[float, float, float, float]
Range = tuple[float, float]
Mode = Literal["free", "table", "fixture", "fixed"]

PLACEMENT_KEYS: dict[str, tuple[str, ...]] = {
    "fixed": ("position_mm", "rotation_deg", "matrix"),
    "free": ("box_mm", "rotation_deg", "largest_turn_deg"),
    "table": ("table_z_mm", "table_x_mm", "table_y_mm", "table_turn_deg", "up"),
    "fixture": ("poses_mm_deg",),
}
"""The keys that each mode takes."""


@dataclass(frozen=True, kw_only=True)
class PlacementKeys:
    """Where the part stands in the machine: chosen by the planner, within bounds, or fixed by you."""

    mode: Annotated[
        Mode,
        Key(
            "",
            'planner\'s choice: "free", "table" (the part stands on one) or "fixture" (one of given poses); yours: '
            '"fixed"',
        ),
    ] = "free"
    position: Annotated[
        VECTOR | None, Key("mm", "fixed: where the mesh's origin is, machine frame (base plane: z = 0)")
    ] = None
    rotation: Annotated[
        VECTOR | None,
        Key(
            "deg",
            "fixed: rotations about the machine's fixed x, then y, then z axis; free: the rotation from which "
            "largest_turn_deg counts",
        ),
    ] = None
    matrix: Annotated[tuple[Row, Row, Row, Row] | None, Key("", "fixed: both as a 4x4 matrix, translation in mm")] = (
        None
    )
    box: Annotated[
        tuple[VECTOR, VECTOR] | None,
        Key("mm", "free: the mesh's origin stays in this box: two opposite corners, machine frame"),
    ] = None
    largest_turn: Annotated[
        float | None, Key("deg", "free: largest rotation of the part from rotation_deg", ge=0.0, le=180.0)
    ] = None
    table_z: Annotated[
        float | None, Key("mm", "table: z of its surface, machine frame; the part's lowest point rests on it")
    ] = None
    table_x: Annotated[Range | None, Key("mm", "table: least and greatest x of the mesh's origin")] = None
    table_y: Annotated[Range | None, Key("mm", "table: least and greatest y of the mesh's origin")] = None
    table_turn: Annotated[
        Range | None,
        Key(
            "deg",
            "table: least and greatest direction of the mesh's x axis in plan, of its y axis where x stands upright: "
            "0 is the machine's x, 90 its y; [0, 0] keeps it along x",
        ),
    ] = None
    up: Annotated[VECTOR, Key("", "table: which direction is up (to the base), mesh frame")] = (0.0, 0.0, 1.0)
    poses: Annotated[
        tuple[Pose, ...] | None,
        Key("", "fixture: poses to choose from, each position_mm and rotation_deg", name="poses_mm_deg", min_length=1),
    ] = None
    weight_strokes: Annotated[
        float, Key("", "weight of the margins of the strokes, against singularities, joints and bodies", gt=0.0)
    ] = 1.0
    weight_singularities: Annotated[float, Key("", "weight of the distances to singular poses", gt=0.0)] = 1.0
    weight_joints: Annotated[float, Key("", "weight of the angles of base and platform joints", gt=0.0)] = 1.0
    weight_bodies: Annotated[float, Key("", "weight of the gaps between bodies", gt=0.0)] = 1.0
    weight_stiffness: Annotated[
        float | None,
        Key(
            "",
            "weight of the stiffness at the tip, of machines that give stiffness_n_um; not looked at when left out",
            gt=0.0,
        ),
    ] = None
    then: Annotated[
        Literal["force", "time"] | None,
        Key(
            "",
            "secondary objective, for up to a tenth of the margin: least leg force per cutting force, or least "
            "machining time",
        ),
    ] = None
    component: Annotated[
        Literal["++", "+-", "-+", "--"] | None,
        Key("", "signs of w and S of the assembly mode; the best one when left out"),
    ] = None
    setups: Annotated[
        int, Key("", "largest number of set-ups, where one placement cannot reach the whole path", ge=1, le=20)
    ] = 1
    solver: Annotated[
        Literal["sequential", "ipopt"], Key("", '"sequential" (quick), or "ipopt" (the slow reference)')
    ] = "sequential"

    @staticmethod
    def rules(table: Any) -> None:
        """Check the keys that a mode needs, and those that it does not take."""
        mode, given = table.mode, table.model_fields_set
        for other, keys in PLACEMENT_KEYS.items():
            for key in keys:
                if other != mode and key not in PLACEMENT_KEYS[mode] and key in given:
                    wrong(key, f'means nothing when mode = "{mode}"', f'mode = "{other}", or no {key}')
        if mode == "fixed" and table.matrix is None and table.position_mm is None:
            what = "a fixed placement needs " + ("a position" if table.rotation_deg is not None else "its numbers")
            wrong("position_mm", what, "position_mm and rotation_deg, or matrix")
        if table.matrix is not None and (table.position_mm is not None or table.rotation_deg is not None):
            wrong("matrix", "the placement is given twice", "matrix, or position_mm and rotation_deg")
        if mode == "free" and table.rotation_deg is not None and table.largest_turn_deg is None:
            wrong("largest_turn_deg", "rotation_deg alone bounds nothing", "the largest rotation from rotation_deg")
        if mode == "table" and table.table_z_mm is None:
            wrong("table_z_mm", "the table's height is missing", "z of its surface in mm")
        if mode == "fixed" and table.setups > 1:
            wrong("setups", "one fixed placement is one set-up", "another mode, or no setups")
        if mode == "fixture" and table.poses_mm_deg is None:
            wrong("poses_mm_deg", "the fixture's poses are missing", "[[x, y, z, turn x, turn y, turn z], ...]")
        for key in ("table_x_mm", "table_y_mm", "table_turn_deg"):
            ends = getattr(table, key)
            if ends is not None and ends[0] > ends[1]:
                wrong(key, "the range is empty", "[least, greatest]")
        if not any(table.up):
            wrong("up", "the direction is zero", "a direction such as [0, 0, 1]")


@dataclass(frozen=True, kw_only=True)
class FixtureKeys:
    """Fixture: a further body that legs, spindle and tool must not touch."""

    mesh: Annotated[
        str | None, Key("", "mesh file of a vise, clamps, a table; relative to this job file", min_length=1)
    ] = None
    unit: Annotated[
        Literal["mm", "cm", "m", "inch"] | None,
        Key("", "unit of the numbers in its mesh file, unless the file states it"),
    ] = None
    scale: Annotated[float, Key("", "factor applied to it after its unit", gt=0.0)] = 1.0
    frame: Annotated[
        Literal["part", "machine"],
        Key("", 'frame of its mesh: "part" (it moves with the part) or "machine" (it stays)'),
    ] = "part"

    @staticmethod
    def rules(table: Any) -> None:
        """Check that a mesh comes with its unit."""
        if table.mesh is not None and table.unit is None and not states_unit(table.mesh):
            wrong("unit", "the unit of the fixture's mesh is missing", "mm, cm, inch or m")


PlacementTable = table_of(PlacementKeys)
FixtureTable = table_of(FixtureKeys)
