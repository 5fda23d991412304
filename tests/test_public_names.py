"""A part is planned and judged with a tool body, an axis mode, a gouge remedy and a fixture, by public names alone."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod import (
    BullNose,
    CollisionWorld,
    Component,
    Cone,
    Coverage,
    Cutting,
    Fixed,
    FlatEnd,
    GougeOptions,
    Lollipop,
    Machine,
    Mesh,
    Orientation,
    PlacementConstraints,
    PostInput,
    RasterOptions,
    Remedy,
    RigidTransform,
    leg_path,
    load_mesh,
    make_toolpath,
    oriented,
    plan,
    read_csv,
    read_post,
    retime,
    sample,
    stepped,
    verify,
    without_gouges,
    write_csv,
    write_post,
)
from pentapod.cli.commands.new import dome_stl

BODY = {"shank": (Cone(0.02, 4e-3, 4e-3),), "holder": (Cone(0.02, 8e-3, 12e-3),)}
TOOLS = {
    "flat": FlatEnd(5e-3, flute=0.015, **BODY),
    "bull nose": BullNose(5e-3, 1.5e-3, flute=0.015, **BODY),
    "lollipop": Lollipop(5e-3, 2e-3, 0.03, **BODY),
}
SIDES = (
    (0, 1, 3),
    (0, 3, 2),
    (4, 7, 5),
    (4, 6, 7),
    (0, 4, 5),
    (0, 5, 1),
    (2, 3, 7),
    (2, 7, 6),
    (0, 2, 6),
    (0, 6, 4),
    (1, 5, 7),
    (1, 7, 3),
)


def block(low, high):
    corners = [[(low, high)[k >> 2][0], (low, high)[k >> 1 & 1][1], (low, high)[k & 1][2]] for k in range(8)]
    return Mesh.of(np.array(corners), np.array(SIDES))


@pytest.mark.parametrize(
    "kind", ["lollipop", *(pytest.param(k, marks=pytest.mark.slow) for k in ("flat", "bull nose"))]
)
def test_a_part_with_tool_body_and_fixture(kind, tmp_path):
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    machine, part, tool = Machine.load("desk"), load_mesh(tmp_path / "part.stl", "mm"), TOOLS[kind]
    vise = block((-0.06, 0.034, -0.03), (0.06, 0.05, -0.01))
    passes = RasterOptions(stepover=15e-3, spacing=4e-3)
    standing = Orientation(mode=Fixed((0.0, 0.0, 1.0)))
    toolpath = stepped(oriented(make_toolpath(part, tool, passes), tool, standing), np.radians(3.0))
    remedies = GougeOptions(remedies=(Remedy.LIFT, Remedy.DROP))
    toolpath, report = without_gouges(toolpath, tool, part, remedies)
    assert report.motions > 0
    assert report.left == 0

    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    bodies = CollisionWorld.of(machine, tool, part, fixture=vise)
    asked = {
        "constraints": PlacementConstraints.fixture([here]),
        "component": Component.parse("++"),
        "collision_world": bodies,
    }
    limits = {"path_tolerance": 50e-6, "axis_tolerance": np.radians(0.5)}
    placed = plan(toolpath, machine, **asked)
    trajectory = retime(leg_path(placed, machine, **limits), machine)
    program = write_csv(sample(trajectory, machine, placed), tmp_path / "a.csv")
    coverage = Coverage.of(part, tool, passes, path_tolerance=limits["path_tolerance"], share=1.0)
    told = {**asked, **limits, "tilt": 0.0, "cutting": Cutting.of(part, tool, coverage=coverage)}
    verdict = verify(program, machine, toolpath, **told)
    assert verdict.passed, verdict.answer
    claims = {c.claim for c in verdict.certificates}
    assert {"gouge on cuts and links", "surface left on the region", "placement as the job asks"} <= claims

    posted = PostInput(read_csv(program), machine)
    write_post(posted, "npz", tmp_path / "post", verdict=verdict.to_dict())
    assert read_post(tmp_path / "post", "npz") == posted.program

    # A vise that stands where the holder goes is found, and what was not told does not pass.
    high = block((-0.06, -0.01, -0.03), (0.06, 0.01, 0.06))
    told["collision_world"] = CollisionWorld.of(machine, tool, part, fixture=high)
    assert not verify(program, machine, toolpath, **told).passed
    del told["cutting"]
    assert {entry.claim for entry in verify(program, machine, toolpath, **told).not_judged} >= {
        "surface left on the region"
    }
