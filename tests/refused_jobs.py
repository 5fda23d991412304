"""Jobs that are refused as they stand, or are an error about the region or the size: made here, and of parts by others.

Each is a mesh and the tables of a job. The toolpaths are coarse, so that many can be planned.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from concave_parts import GENERATED
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import CalibrationRecord, Machine, calibrate, record_of, write_calibration
from pentapod.machine.reader import machine_bytes

Tables = dict[str, dict[str, Any]]

USUAL: Tables = {
    "part": {"mesh": "part.stl", "unit": "mm"},
    "machine": {"name": "desk"},
    "tool": {"type": "ball", "diameter_mm": 6.0},
    "toolpath": {"stepover_mm": 10.0, "spacing_mm": 5.0},
    "axis": {},
    "gouge": {},
    "feed": {"cut_mm_min": 6000.0},
    "tolerance": {"chordal_mm": 0.05, "path_mm": 0.1, "left_share": 1.0},
    "placement": {},
}
"""What the jobs have in common. The passes are wider apart than the cutter likes, and may leave what they leave."""


@dataclass(frozen=True)
class Refused:
    """A job that is refused. shape: vertices and faces, in the unit of the job; None for a part by others.

    other: the file of a part by others. edits: of the machine file `desk`, texts to replace. calibrated: `desk` as it
    was built, with a calibration. files: beside the job, by name.
    """

    shape: Callable[[], tuple[np.ndarray, np.ndarray]] | None
    tables: Tables
    other: str = ""
    edits: tuple[tuple[str, str], ...] = field(default=())
    calibrated: bool = False
    files: dict[str, str] = field(default_factory=dict)

    def write(self, folder: Path, parts: Path | None = None) -> Path:
        """Write job, mesh and machine into a folder; return the job's path."""
        tables = {name: {**keys, **self.tables.get(name, {})} for name, keys in USUAL.items()}
        if self.shape is not None:
            vertices, faces = self.shape()
            trimesh.Trimesh(vertices, faces, process=False).export(folder / "part.stl")
        else:
            assert parts is not None
            tables["part"]["mesh"] = str(parts / self.other)
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        if self.edits or self.calibrated:
            text = machine_bytes("desk").decode()
            for old, new in self.edits:
                assert old in text
                text = text.replace(old, new)
            if self.calibrated:
                write_calibration(calibration(), folder / "calibration.toml")
                text += '\n[calibration]\nfile = "calibration.toml"\n'
            (folder / "machine.toml").write_text(text)
            tables["machine"] = {"file": "machine.toml"}
        lines: list[str] = []
        for name, keys in tables.items():
            given = {key: value for key, value in keys.items() if value is not None}
            lines += [f"[{name}]", *(f"{key} = {literal(value)}" for key, value in given.items()), ""]
        (folder / "job.toml").write_text("\n".join(lines), encoding="utf-8")
        return folder / "job.toml"


@cache
def calibration() -> CalibrationRecord:
    """Calibration of a machine `desk` whose joints are off by some tenths of a millimetre."""
    desk, rng = Machine.load("desk"), np.random.default_rng(1)
    errors = {"base_errors": 2e-4 * rng.normal(size=(5, 3)), "zeros": 5e-4 * rng.normal(size=5)}
    built = AsBuiltPentapod.of(desk.robot, **errors, radii=[0.0, 0.01, 0.0, 0.03, 0.0])
    axes = np.column_stack([rng.uniform(-0.4, 0.4, (40, 2)), np.ones(40)])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    places = rng.uniform((-0.1, -0.1, 0.25), (0.1, 0.1, 0.35), (40, 3))
    found = calibrate(places, axes, built.leg_lengths(places, axes), desk.robot, leg_sigma=1e-6)
    return record_of(found, "desk", desk.robot, datetime.date(2026, 1, 31))


def literal(value: Any) -> str:
    """A value in TOML."""
    if isinstance(value, str):
        return f'"{value}"'
    return str(value).lower() if isinstance(value, bool) else str(value).replace("(", "[").replace(")", "]")


def cap(radius: float, degrees: float, rings: int = 24) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """A cap of a sphere, mm, whose slope at its rim is `degrees`."""

    def shape() -> tuple[np.ndarray, np.ndarray]:
        polar = np.radians(degrees) * np.arange(rings + 1) / rings
        turn = 2.0 * np.pi * np.arange(64) / 64
        ring = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
        points = [radius * (np.sin(a) * ring + np.cos(a) * np.array([0.0, 0.0, 1.0])) for a in polar[1:]]
        vertices = np.concatenate([[[0.0, 0.0, radius]], *points])
        k, after = np.arange(64), (np.arange(64) + 1) % 64
        faces = [np.stack([0 * k, 1 + k, 1 + after], axis=1)]
        for n in range(rings - 1):
            inner, outer = 1 + 64 * n, 65 + 64 * n
            faces += [
                np.stack([inner + k, outer + k, outer + after], axis=1),
                np.stack([inner + k, outer + after, inner + after], axis=1),
            ]
        return vertices, np.concatenate(faces)

    return shape


def plate(length: float, width: float, sag: float = 0.0) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """A sheet, mm, bent along its length by `sag`."""

    def shape() -> tuple[np.ndarray, np.ndarray]:
        u, v = np.meshgrid(np.linspace(-0.5, 0.5, 25), np.linspace(-0.5, 0.5, 9), indexing="ij")
        points = np.stack([length * u, width * v, -4.0 * sag * u**2], axis=-1)
        a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
        facets = np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))])
        return facets.reshape(-1, 3), np.arange(3 * len(facets)).reshape(-1, 3)

    return shape


def block(x: float, y: float, z: float) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """A solid block, mm, on z = 0."""

    def shape() -> tuple[np.ndarray, np.ndarray]:
        made = trimesh.creation.box((x, y, z))
        return np.add(made.vertices, [0.0, 0.0, 0.5 * z]), made.faces

    return shape


def turned_over(shape: Callable[[], tuple[np.ndarray, np.ndarray]]) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """A shape whose facets are wound the other way."""

    def shape_of() -> tuple[np.ndarray, np.ndarray]:
        vertices, faces = shape()
        return vertices, faces[:, ::-1]

    return shape_of


def under_a_roof() -> tuple[np.ndarray, np.ndarray]:
    """A block of 40 x 40 x 10 mm on z = 0, and a larger one above it."""
    (low, below), (high, above) = block(40.0, 40.0, 10.0)(), block(60.0, 60.0, 5.0)()
    return np.concatenate([low, np.add(high, [0.0, 0.0, 40.0])]), np.concatenate([below, above + len(low)])


def at(z: float, turn: tuple[float, float, float] = (180.0, 0.0, 0.0)) -> dict[str, Any]:
    """A fixed placement at a height of the machine."""
    return {"mode": "fixed", "position_mm": [85.0, -17.0, z], "rotation_deg": list(turn)}


NO_PASSES = {"stepover_mm": None, "spacing_mm": None}
APT = """PARTNO/LINES
UNITS/MM
CUTTER/6
MULTAX/ON
RAPID
GOTO/-20,0,40,{i},0,{k}
FEDRAT/600,MMPM
GOTO/-20,0,1,{i},0,{k}
GOTO/20,0,1,{i},0,{k}
GOTO/20,10,1,{i},0,{k}
GOTO/-20,10,1,{i},0,{k}
RAPID
GOTO/-20,10,40,{i},0,{k}
FINI
"""
STRICT = {"tilt_deg": 0.0}
LARGE = {"toolpath": {"stepover_mm": 120.0, "spacing_mm": 30.0}, "feed": {"cut_mm_min": 20000.0}}
SCANT = {"toolpath": {"stepover_mm": 300.0, "spacing_mm": 60.0}, "feed": {"cut_mm_min": 20000.0}}

FINISHED: Tables = {
    "toolpath": {"stepover_mm": 3.0, "spacing_mm": 2.0},
    "feed": {"cut_mm_min": 1500.0},
    "tolerance": {"chordal_mm": 0.01, "path_mm": 0.02, "left_share": 0.001},
}
"""As a user would have it; little may be left."""

REFUSED: dict[str, Refused] = {
    # concave blocks, the tool along the normals
    **{f"{name} along normals": Refused(GENERATED[name], {}) for name in GENERATED if name != "egg_crate"},
    "block along normals": Refused(block(60.0, 40.0, 20.0), {}),
    "block of a first part": Refused(block(80.0, 60.0, 31.0), {"toolpath": {"stepover_mm": 10.0}}),
    "block of a first part, finished": Refused(block(80.0, 60.0, 31.0), FINISHED),
    "block whose walls a raster leaves": Refused(block(80.0, 60.0, 31.0), {**FINISHED, "axis": {"mode": "auto"}}),
    "block with passes 70 mm apart": Refused(block(60.0, 40.0, 17.0), {**FINISHED, "toolpath": {"stepover_mm": 70.0}}),
    # domes too steep, cones too narrow
    "dome of 60 deg, no cone": Refused(cap(30.0, 60.0), {"axis": STRICT}),
    "dome of 75 deg": Refused(cap(30.0, 75.0), {}),
    "dome of 85 deg": Refused(cap(25.0, 85.0), {}),
    "dome of 70 deg, cone of 5": Refused(cap(30.0, 70.0), {"axis": {"tilt_deg": 5.0}}),
    "large dome of 50 deg, no cone": Refused(cap(70.0, 50.0), {"axis": STRICT, "toolpath": {"stepover_mm": 15.0}}),
    "dome of 60 deg, beam": Refused(
        cap(30.0, 60.0), {"tool": {"type": "standoff", "diameter_mm": None, "standoff_mm": 40.0}, "axis": STRICT}
    ),
    "dome of 55 deg, flat end": Refused(cap(40.0, 55.0), {"tool": {"type": "flat"}, "axis": STRICT}),
    "dome of 55 deg, bull nose": Refused(cap(40.0, 55.0), {"tool": {"type": "bull", "corner_mm": 1.0}, "axis": STRICT}),
    # parts too large
    "plate of 600 x 600": Refused(plate(600.0, 600.0), LARGE),
    "plate of 900 x 100": Refused(plate(900.0, 100.0), LARGE),
    "plate of 700 x 60, bent": Refused(plate(700.0, 60.0, 40.0), LARGE),
    "plate of 450 x 450, bent": Refused(plate(450.0, 450.0, 60.0), LARGE),
    "plate of 1500 x 1500": Refused(plate(1500.0, 1500.0), SCANT),
    "plate of 3 x 2 m": Refused(plate(3000.0, 2000.0), SCANT),
    "block of 500 x 300 x 200": Refused(block(500.0, 300.0, 200.0), LARGE),
    "large cap": Refused(cap(300.0, 60.0), LARGE),
    "dome in inches": Refused(cap(60.0, 40.0), {"part": {"unit": "inch"}}),
    "dome in metres": Refused(cap(60.0, 40.0), {"part": {"unit": "m"}}),
    # tools too long, too short, too wide
    "tool of 450 mm on a table": Refused(
        cap(60.0, 35.0), {"tool": {"length_mm": 450.0}, "placement": {"mode": "table", "table_z_mm": 480.0}}
    ),
    "tool of 700 mm on a table": Refused(
        plate(60.0, 60.0, 5.0), {"tool": {"length_mm": 700.0}, "placement": {"mode": "table", "table_z_mm": 480.0}}
    ),
    "tool of 380 mm on a table": Refused(
        cap(60.0, 35.0), {"tool": {"length_mm": 380.0}, "placement": {"mode": "table", "table_z_mm": 480.0}}
    ),
    "tool of 174 mm, cone of 11": Refused(
        cap(117.0, 40.0),
        {
            "tool": {"length_mm": 174.0},
            "axis": {"tilt_deg": 11.0},
            "placement": {"mode": "table", "table_z_mm": 450.0},
        },
    ),
    # a wrong fixed axis
    "axis downwards": Refused(cap(60.0, 35.0), {"axis": {"mode": "fixed", "direction": [0, 0, -1]}}),
    "axis from a point below": Refused(
        cap(40.0, 70.0), {"axis": {"mode": "from", "point_mm": [0, 0, 5], "tilt_deg": 0}}
    ),
    # placements
    "too far": Refused(cap(60.0, 30.0), {"placement": at(1200.0)}),
    "too near": Refused(cap(60.0, 30.0), {"placement": at(200.0)}),
    "upside down": Refused(cap(60.0, 30.0), {"placement": at(480.0, (0.0, 0.0, 0.0))}),
    "table too low": Refused(cap(60.0, 30.0), {"placement": {"mode": "table", "table_z_mm": 900.0}}),
    "table too high": Refused(cap(60.0, 30.0), {"placement": {"mode": "table", "table_z_mm": 150.0}}),
    "box of origins far away": Refused(
        cap(60.0, 30.0), {"placement": {"box_mm": [[900.0, 900.0, 400.0], [950.0, 950.0, 450.0]]}}
    ),
    "component that does not reach": Refused(cap(60.0, 30.0), {"placement": {**at(480.0), "component": "--"}}),
    # regions
    "box beside the part": Refused(
        cap(60.0, 30.0), {"part": {"region_box_mm": [[200.0, 200.0, 0.0], [250.0, 250.0, 90.0]]}}
    ),
    "region of another side": Refused(cap(60.0, 30.0), {"part": {"region_direction": [0, 0, -1]}}),
    "steep part, narrow angle": Refused(
        cap(60.0, 30.0), {"part": {"region_direction": [1, 0, 0], "region_angle_deg": 20.0}}
    ),
    # modified machines
    "short strokes": Refused(cap(60.0, 30.0), {}, edits=(("max_length_mm = 929", "max_length_mm = 660"),)),
    "long legs": Refused(cap(60.0, 30.0), {}, edits=(("min_length_mm = 489", "min_length_mm = 850"),)),
    "narrow base cones": Refused(cap(60.0, 45.0), {}, edits=(("base_cone_deg = 35", "base_cone_deg = 14"),)),
    "narrow platform joints": Refused(
        cap(60.0, 45.0), {}, edits=(("platform_max_deg = 112", "platform_max_deg = 75"),)
    ),
    "thick legs": Refused(cap(60.0, 45.0), {"axis": STRICT}, edits=(("leg_diameter_mm = 16", "leg_diameter_mm = 30"),)),
    # other machines, and one as it was built
    "steep: dome of 85 deg, no cone": Refused(cap(20.0, 85.0), {"machine": {"name": "steep"}, "axis": STRICT}),
    "steep: table too low": Refused(
        cap(50.0, 30.0), {"machine": {"name": "steep"}, "placement": {"mode": "table", "table_z_mm": 900.0}}
    ),
    "general: dome of 60 deg, no cone": Refused(
        cap(20.0, 60.0), {"machine": {"name": "bench-general"}, "axis": STRICT}
    ),
    "general: too near": Refused(cap(50.0, 25.0), {"machine": {"name": "bench-general"}, "placement": at(200.0)}),
    "general: table too low": Refused(
        cap(50.0, 25.0),
        {"machine": {"name": "bench-general"}, "placement": {"mode": "table", "table_z_mm": 900.0}},
    ),
    "general: plate of 900 x 100": Refused(plate(900.0, 100.0), {"machine": {"name": "bench-general"}, **LARGE}),
    "guide: dome of 65 deg, no cone": Refused(cap(20.0, 65.0), {"machine": {"name": "guide"}, "axis": STRICT}),
    "guide: table too high": Refused(
        cap(50.0, 30.0), {"machine": {"name": "guide"}, "placement": {"mode": "table", "table_z_mm": 150.0}}
    ),
    "guide: too far": Refused(cap(50.0, 30.0), {"machine": {"name": "guide"}, "placement": at(1200.0)}),
    "calibrated: dome of 65 deg, no cone": Refused(cap(20.0, 65.0), {"axis": STRICT}, calibrated=True),
    "calibrated: table too high": Refused(
        cap(50.0, 30.0), {"placement": {"mode": "table", "table_z_mm": 150.0}}, calibrated=True
    ),
    "calibrated: fixed, leaning": Refused(
        cap(50.0, 30.0), {"placement": at(470.0, (225.0, 0.0, 0.0)), "axis": STRICT}, calibrated=True
    ),
    # turned parts
    "bottom of a block on a table": Refused(
        block(50.0, 40.0, 30.0),
        {
            "part": {"region_direction": [0, 0, -1], "region_angle_deg": 80.0},
            "placement": {"mode": "table", "table_z_mm": 500.0},
        },
    ),
    "block upside down on a table": Refused(
        block(50.0, 40.0, 15.0), {"placement": {"mode": "table", "table_z_mm": 480.0, "up": [0, 0, -1]}}
    ),
    "block on its side on a table": Refused(
        block(50.0, 40.0, 30.0),
        {
            "axis": {"mode": "fixed", "direction": [0, 0, 1]},
            "placement": {"mode": "table", "table_z_mm": 480.0, "up": [1, 0, 0]},
        },
    ),
    "dome fixed on its side": Refused(cap(50.0, 30.0), {"placement": at(470.0, (90.0, 0.0, 0.0))}),
    "fixed, leaning": Refused(cap(50.0, 30.0), {"placement": at(470.0, (225.0, 0.0, 0.0)), "axis": STRICT}),
    # no toolpath
    "hidden under a roof": Refused(under_a_roof, {"part": {"region_box_mm": [[-25, -25, -1], [25, 25, 15]]}}),
    "waterlines on a plate": Refused(plate(60.0, 60.0), {"toolpath": {"strategy": "waterline"}}),
    "holder wider than a pocket": Refused(
        GENERATED["pocket_boss"], {"tool": {"holder_mm": [[30.0, 60.0, 60.0]], "flute_mm": 3.5}}
    ),
    "closed part, inside out": Refused(turned_over(block(50.0, 40.0, 15.0)), {}),
    "sheet wound downwards": Refused(turned_over(plate(50.0, 40.0, 3.0)), {}),
    "toolpath from a file, too far": Refused(
        plate(60.0, 60.0),
        {"toolpath": {"strategy": "file", "file": "path.apt", **NO_PASSES}, "placement": at(1200.0)},
        files={"path.apt": APT.format(i=0.0, k=1.0)},
    ),
    "toolpath from a file, leaning": Refused(
        plate(60.0, 60.0),
        {"toolpath": {"strategy": "file", "file": "path.apt", **NO_PASSES}, "placement": at(470.0), "axis": STRICT},
        files={"path.apt": APT.format(i=0.8, k=0.6)},
    ),
    # programs that fail their verdict
    "passes too far apart": Refused(
        cap(40.0, 25.0), {"toolpath": {"stepover_mm": 3.0}, "tolerance": {"left_mm": 0.2, "left_share": 0.001}}
    ),
    "passes too far apart at the rim": Refused(
        cap(20.0, 70.0),
        {
            "axis": {"mode": "auto"},
            "toolpath": {"stepover_mm": 3.0},
            "tolerance": {"left_mm": 0.2, "left_share": 0.001},
        },
    ),
    "gouges only reported": Refused(
        GENERATED["pocket_boss"],
        {
            "tool": {"type": "flat", "flute_mm": 4.0, "shank_mm": [[30.0, 9.0, 9.0]]},
            "gouge": {"remedy": ["report"]},
            "axis": {"mode": "fixed", "direction": [0, 0, 1], "tilt_deg": 0.0},
        },
    ),
    # parts by others
    "torus": Refused(None, {"part": {"scale": 40.0}}, "torus.STL"),
    "sphere": Refused(None, {"part": {"scale": 60.0}}, "unit_sphere.STL"),
    "fan disk": Refused(None, {"part": {"scale": 60.0}}, "fandisk.obj"),
    "wavy mesh": Refused(
        None, {"part": {"scale": 60.0}, "axis": STRICT, "toolpath": {"stepover_mm": 30.0}}, "wavy_mesh_with_hole.ply"
    ),
    "vase": Refused(None, LARGE, "wavy_vase_open_low_res.stl"),
    "facade": Refused(None, {"part": {"region_direction": [1, 0, 0]}, **LARGE}, "facade_infill_open_mid_res.stl"),
    "tray": Refused(None, {"part": {"scale": 1.0, "region_direction": [0, 1, 0]}, **LARGE}, "1002_tray_bottom.STL"),
    "teapot": Refused(None, {"part": {"scale": 12.0}}, "teapot.stl"),
    "octagonal pocket": Refused(None, {"part": {"unit": "m", "scale": 0.6}}, "octagonal_pocket.stl"),
}
