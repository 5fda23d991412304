"""Schema of [placement] and [fixture]: where the part stands, and what holds it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from pentapod.base.tables import Positive, Table, Vector, wrong

Pose = tuple[float, float, float, float, float, float]
Row = tuple[float, float, float, float]
Range = tuple[float, float]


class PlacementTable(Table):
    """Where the part stands in the machine: left to the planner, bounded, or fixed by you."""

    mode: Literal["free", "table", "fixture", "fixed"] = Field(
        default="free",
        description='"free", "table" (it stands on one), "fixture" (one of given poses), or "fixed": all but the last '
        "leave the choice to the planner",
    )
    position_mm: Vector | None = Field(
        default=None, description="fixed: where the mesh's origin goes, machine frame (base plane: z = 0)"
    )
    rotation_deg: Vector | None = Field(
        default=None,
        description="fixed: turns about the machine's fixed x, then y, then z axis; free: from where largest_turn_deg "
        "counts",
    )
    matrix: tuple[Row, Row, Row, Row] | None = Field(
        default=None,
        description="fixed: both as a 4x4 matrix, translation in mm",
    )
    box_mm: tuple[Vector, Vector] | None = Field(
        default=None, description="free: the mesh's origin stays in this box: two opposite corners, machine frame"
    )
    largest_turn_deg: float | None = Field(
        default=None, ge=0.0, le=180.0, description="free: largest turn of the part from rotation_deg"
    )
    table_z_mm: float | None = Field(
        default=None, description="table: z of its surface, machine frame; the part's lowest point rests on it"
    )
    table_x_mm: Range | None = Field(default=None, description="table: least and greatest x of the mesh's origin")
    table_y_mm: Range | None = Field(default=None, description="table: least and greatest y of the mesh's origin")
    up: Vector = Field(default=(0.0, 0.0, 1.0), description="table: which direction is up (to the base), mesh frame")
    poses_mm_deg: tuple[Pose, ...] | None = Field(
        default=None, min_length=1, description="fixture: poses to choose from, each position_mm and rotation_deg"
    )
    weight_strokes: Positive = Field(
        default=1.0, description="weight of the margins of the strokes, against singularities, joints and bodies"
    )
    weight_singularities: Positive = Field(default=1.0, description="weight of the distances to singular poses")
    weight_joints: Positive = Field(default=1.0, description="weight of the angles of base and platform joints")
    weight_bodies: Positive = Field(default=1.0, description="weight of the gaps between bodies")
    then: Literal["force", "time"] | None = Field(
        default=None,
        description="secondary objective, for up to a tenth of the margin: least leg force per cutting force, or least "
        "machining time",
    )
    component: Literal["++", "+-", "-+", "--"] | None = Field(
        default=None, description="signs of w and S of the assembly mode; the best one when left out"
    )
    setups: int = Field(
        default=1,
        ge=1,
        le=20,
        description="most set-ups into which the work may be split where one placement cannot reach all of it",
    )
    solver: Literal["sequential", "ipopt"] = Field(
        default="sequential", description='"sequential" (quick), or "ipopt" (the slow reference)'
    )

    @model_validator(mode="after")
    def _numbers(self) -> PlacementTable:
        for mode, keys in PLACEMENT_KEYS.items():
            for key in keys:
                if mode != self.mode and key not in PLACEMENT_KEYS[self.mode] and key in self.model_fields_set:
                    wrong(key, f'means nothing when mode = "{self.mode}"', f'mode = "{mode}", or no {key}')
        if self.mode == "fixed" and self.matrix is None and self.position_mm is None:
            what = "a fixed placement needs " + ("a position" if self.rotation_deg is not None else "its numbers")
            wrong("position_mm", what, "position_mm and rotation_deg, or matrix")
        if self.matrix is not None and (self.position_mm is not None or self.rotation_deg is not None):
            wrong("matrix", "the placement is given twice", "matrix, or position_mm and rotation_deg")
        if self.mode == "free" and self.rotation_deg is not None and self.largest_turn_deg is None:
            wrong("largest_turn_deg", "a rotation alone bounds nothing", "the largest turn from rotation_deg")
        if self.mode == "table" and self.table_z_mm is None:
            wrong("table_z_mm", "the table's height is missing", "z of its surface in mm")
        if self.mode == "fixed" and self.setups > 1:
            wrong("setups", "one fixed placement is one set-up", "another mode, or no setups")
        if self.mode == "fixture" and self.poses_mm_deg is None:
            wrong("poses_mm_deg", "the fixture's poses are missing", "[[x, y, z, turn x, turn y, turn z], ...]")
        for key in ("table_x_mm", "table_y_mm"):
            ends = getattr(self, key)
            if ends is not None and ends[0] > ends[1]:
                wrong(key, "the range is empty", "[least, greatest]")
        if not any(self.up):
            wrong("up", "the direction is zero", "a direction such as [0, 0, 1]")
        return self


PLACEMENT_KEYS: dict[str, tuple[str, ...]] = {
    "fixed": ("position_mm", "rotation_deg", "matrix"),
    "free": ("box_mm", "rotation_deg", "largest_turn_deg"),
    "table": ("table_z_mm", "table_x_mm", "table_y_mm", "up"),
    "fixture": ("poses_mm_deg",),
}
"""The keys that each mode takes."""


class FixtureTable(Table):
    """Fixture: a further body that legs, spindle and tool must not touch."""

    mesh: str | None = Field(
        default=None, min_length=1, description="mesh file of a vise, clamps, a table; relative to this job file"
    )
    unit: Literal["mm", "cm", "m", "inch"] | None = Field(
        default=None, description="unit of the numbers in its mesh file: compulsory with mesh"
    )
    scale: Positive = Field(default=1.0, description="factor applied to it after its unit")
    frame: Literal["part", "machine"] = Field(
        default="part", description='frame of its mesh: "part" (it moves with the part) or "machine" (it stays)'
    )

    @model_validator(mode="after")
    def _known_unit(self) -> FixtureTable:
        if self.mesh is not None and self.unit is None:
            wrong("unit", "the unit of the fixture's mesh is missing", "mm, cm, inch or m")
        return self
