"""Job files: every mistake is one line that names file, key, value and remedy."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.base.errors import JobError
from pentapod.job import Job
from pentapod.job.build.toolpath import job_options
from pentapod.job.build.values import job_mesh
from pentapod.job.schema.strategies import job_strategies
from pentapod.job.schema.tables import JobTables, table_model

FEED = "cut_mm_min = 3000"
STEP = "stepover_mm = 15"

MISTAKES = {  # what is replaced, and the pieces that the message must hold
    "unknown key": ((STEP, "stepovr_mm = 15"), ("toolpath.stepovr_mm", "unknown key", 'did you mean "stepover_mm"')),
    "unknown strategy": ((STEP, f'{STEP}\nstrategy = "rastr"'), ("toolpath.strategy", "got 'rastr'", '"raster"')),
    "a key of another strategy": (
        (STEP, f'{STEP}\nstrategy = "waterline"\npattern = "zigzag"'),
        ("job.toml:15", "toolpath.pattern", 'the strategy "waterline" has no such key', "take it out; known: "),
    ),
    "no text": ((STEP, 'strategy = "text"'), ("toolpath.text", "missing", "the text")),
    "no such drawing": (
        (STEP, 'strategy = "drawing"\nfile = "none.svg"'),
        ("job.toml:14", "toolpath.file", "none.svg", "no such file"),
    ),
    "unknown table": (("[feed]", "[feeds]"), ("feeds", "unknown table", 'did you mean "feed"')),
    "negative stepover": (
        (STEP, "stepover_mm = -2"),
        ("job.toml:13", "toolpath.stepover_mm", "got -2", "greater than 0"),
    ),
    "feed of zero": ((FEED, "cut_mm_min = 0"), ("feed.cut_mm_min", "out of range", "got 0")),
    "feed is text": ((FEED, 'cut_mm_min = "fast"'), ("feed.cut_mm_min", "got 'fast'", "number")),
    "feed is a truth value": ((FEED, "cut_mm_min = true"), ("feed.cut_mm_min", "number")),
    "feed is nan": ((FEED, "cut_mm_min = nan"), ("feed.cut_mm_min", "finite")),
    "feed is infinite": ((FEED, "cut_mm_min = inf"), ("feed.cut_mm_min",)),
    "feed missing": ((FEED, ""), ("feed.cut_mm_min", "missing", "feed while cutting")),
    "table missing": ((f"[feed]\n{FEED}", ""), ("feed", "table is missing", "cut_mm_min")),
    "table is a number": (("[part]", "feed = 3\n[part]"), ("job.toml",)),
    "unknown unit": (('unit = "mm"', 'unit = "furlong"'), ("part.unit", "furlong", "'inch'")),
    "stepover and scallop": (
        (STEP, f"{STEP}\nscallop_mm = 1"),
        ("toolpath.scallop_mm", "both given", "one of the two"),
    ),
    "neither": ((STEP, ""), ("toolpath.stepover_mm", "missing", "scallop_mm")),
    "wrong tool size": (("diameter_mm = 10", "standoff_mm = 10"), ("tool.diameter_mm", "missing")),
    "two tool sizes": (("diameter_mm = 10", "diameter_mm = 10\nstandoff_mm = 1"), ("tool.standoff_mm", "nothing")),
    "two machines": (('name = "desk"', 'name = "desk"\nfile = "x.toml"'), ("machine.name", "once")),
    "fixed without a position": (("position_mm = ", "# "), ("placement.position_mm", "needs a position")),
    "free with numbers": (('mode = "fixed"', 'mode = "free"'), ("placement.position_mm", "means nothing")),
    "two numbers of three": (("[180, 0, 0]", "[180, 0]"), ("placement.rotation_deg[2]", "too few numbers")),
    "a cone as wide as only auto has": (
        ("tilt_deg = 0", "tilt_deg = 61"),
        ("axis.tilt_deg", "too wide a cone", "got 61", 'at most 60, or mode = "auto"'),
    ),
    "auto with lead": (("tilt_deg = 0", 'mode = "auto"\nlead_deg = 5'), ("axis.lead_deg", "means nothing", "auto")),
    "auto with a direction": (
        ("tilt_deg = 0", 'mode = "auto"\ndirection = [0, 0, 1]'),
        ("axis.direction", 'means nothing for axis mode "auto"'),
    ),
    "no such fixture": (
        ("[feed]", '[fixture]\nmesh = "vise.stl"\nunit = "mm"\n[feed]'),
        ("fixture.mesh", "no such file"),
    ),
    "fixture without unit": (("[feed]", '[fixture]\nmesh = "part.stl"\n[feed]'), ("fixture.unit", "missing")),
    "unknown component": (('"++"', '"+"'), ("placement.component", "'--'")),
    "tolerance of zero": (("path_mm = 0.05", "path_mm = 0"), ("tolerance.path_mm", "greater than 0")),
    "flat region": (('unit = "mm"', 'unit = "mm"\nregion_box_mm = [[0,0,0],[1,1,0]]'), ("part.region_box_mm", "flat")),
    "key outside the tables": (
        ("[part]", "tilt_deg = 3\n[part]"),
        ("job.toml:1: tilt_deg", 'did you mean "axis.tilt_deg"'),
    ),
    "not TOML": (("[feed]", "[feed"), ("job.toml:19:6", "not TOML")),
    "table twice": ((FEED, f"{FEED}\n[part]\nscale = 2"), ("twice", "put all its keys below the same [name]")),
    "key twice": ((FEED, f"{FEED}\n{FEED}"), ("job.toml:21", "not TOML")),
    "no such mesh": (('"part.stl"', '"prat.stl"'), ("job.toml:2", "part.mesh", "prat.stl", "no such file")),
    "mesh is a folder": (('"part.stl"', '"."'), ("part.mesh", "is not a file")),
    "no such variable": (('"part.stl"', '"${NOT_SET_AT_ALL}/part.stl"'), ("part.mesh", "NOT_SET_AT_ALL", "not set")),
    "a name too long": (
        ('"part.stl"', f'"{"x" * 300}.stl"'),
        ("job.toml:2", "part.mesh", "cannot be read: file name too long"),
    ),
    "no such machine file": (('name = "desk"', 'file = "m.toml"'), ("machine.file", "no such file")),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_one_clear_line(mistake, make_job):
    change, pieces = MISTAKES[mistake]
    path = make_job(change)
    with pytest.raises(JobError) as caught:
        Job.load(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    for piece in pieces:
        assert piece in message


@pytest.mark.parametrize(("content", "piece"), [(b"", "empty"), (b"\xff\xfe\x00", "UTF-8"), (b"  \n", "empty")])
def test_files_that_are_no_job(content, piece, tmp_path):
    path = tmp_path / "job.toml"
    path.write_bytes(content)
    with pytest.raises(JobError, match=piece):
        Job.load(path)
    with pytest.raises(JobError, match="no such job file"):
        Job.load(tmp_path / "other.toml")
    with pytest.raises(JobError, match="this is a folder"):
        Job.load(tmp_path)


def test_errors_found_with_the_mesh_name_the_line_of_the_job(make_job):
    leaning = make_job(('type = "ball"', 'type = "flat"'), ("tilt_deg = 0", "tilt_deg = 5"))
    with pytest.raises(JobError, match=r"job\.toml:17: axis\.tilt_deg: .*cannot tilt"):
        Job.load(leaning)
    job = Job.load(make_job(("path_mm = 0.05", "path_mm = 50")))
    with pytest.raises(JobError, match=r"job\.toml:23: tolerance\.path_mm: the tolerance is too large"):
        job_mesh(job)
    job.path.unlink()
    with pytest.raises(JobError, match=r"job\.toml: tolerance\.path_mm: the tolerance is too large"):
        job_mesh(job)


def test_paths_are_relative_to_the_job_and_variables_expand(make_job, tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    assert Job.load(make_job()).mesh_path == tmp_path / "part.stl"
    monkeypatch.setenv("SOME_PARTS", str(tmp_path))
    assert Job.load(make_job(('"part.stl"', '"${SOME_PARTS}/part.stl"'))).mesh_path == tmp_path / "part.stl"


def test_digest_follows_the_meaning(make_job, tmp_path):
    digest = Job.load(make_job()).digest
    assert len(digest) == 16
    assert int(digest, 16) >= 0
    same = [
        ("[feed]", "# a comment\n[feed]"),
        (FEED, "cut_mm_min = 3000.0"),
        ("tilt_deg = 0", "tilt_deg = 0.0  # said again"),
        ("spacing_mm = 4", "spacing_mm = 4\nclearance_mm = 10"),  # the default
        ("spacing_mm = 4", "spacing_mm = 4\nshortest_mm = 0.5"),  # what it is with this stepover
    ]
    assert {Job.load(make_job(change)).digest for change in same} == {digest}
    others = [
        (FEED, "cut_mm_min = 3001"),
        (STEP, "stepover_mm = 15.1"),
        ('"++"', '"+-"'),
        ("path_mm = 0.05", "path_mm = 0.06"),
        ("[feed]", '[fixture]\nmesh = "part.stl"\nunit = "mm"\n[feed]'),
        ("[feed]", '[fixture]\nmesh = "part.stl"\nunit = "cm"\n[feed]'),
    ]
    assert len({Job.load(make_job(change)).digest for change in others} | {digest}) == 1 + len(others)
    (tmp_path / "copy.stl").write_bytes((tmp_path / "part.stl").read_bytes())
    assert Job.load(make_job(('"part.stl"', '"copy.stl"'))).digest == digest
    changed = bytearray((tmp_path / "part.stl").read_bytes())
    changed[100] ^= 1
    assert Job.load(make_job(mesh=bytes(changed))).digest != digest


def test_the_shortest_pass_follows_a_small_stepover(make_job):
    """Passes of a small cutter are short; a digest does not depend on whether the number is said."""
    wide, narrow, said = ((STEP, f"stepover_mm = {text}") for text in ("3", "1", "1\nshortest_mm = 0.5"))
    options = [job_options(Job.load(make_job(change))) for change in (wide, narrow, said)]
    lengths = [each.shortest_pass(each.stepover) for each in options]
    np.testing.assert_allclose(lengths, [0.5e-3, 0.2e-3, 0.5e-3])
    assert Job.load(make_job(narrow)).digest != Job.load(make_job(said)).digest


AUTO = ("tilt_deg = 0", 'mode = "auto"')


BEAM = (('"ball"', '"standoff"'), ("diameter_mm", "standoff_mm"))
FLAT = (('"ball"', '"flat"'),)


@pytest.mark.parametrize(("tool", "most"), [((), 90.0), (BEAM, 15.0), (FLAT, 0.0)])
def test_auto_axes_lean_as_far_as_the_cutter_may(make_job, tool, most):
    job = Job.load(make_job(AUTO, *tool))
    assert job.axis.tilt_deg == pytest.approx(most)
    assert job.axis.si.tilt == pytest.approx(np.radians(most))


def test_a_lean_that_was_not_given_follows_the_cutter_and_one_that_was_is_the_limit(make_job):
    job = Job.load(make_job(AUTO))
    assert job.with_(tool={"type": "flat"}).axis.tilt_deg == 0.0
    assert Job.load(make_job((AUTO[0], 'mode = "auto"\ntilt_deg = 90'))).digest == job.digest
    limited = Job.load(make_job((AUTO[0], 'mode = "auto"\ntilt_deg = 60')))
    assert limited.axis.tilt_deg == 60.0
    assert limited.digest != job.digest


@pytest.mark.parametrize(
    ("changes", "pieces"),
    [
        ((*BEAM, (AUTO[0], 'mode = "auto"\ntilt_deg = 20')), ("axis.tilt_deg", '"standoff" may lean', "at most 15")),
        ((*FLAT, (AUTO[0], 'mode = "auto"\ntilt_deg = 5')), ("axis.tilt_deg", '"flat" may lean', "at most 0")),
        (
            ((f"{STEP}\nspacing_mm = 4", 'strategy = "file"\nfile = "part.stl"'), AUTO),
            ("axis.mode", "a toolpath from a file has axes of its own", 'mode = "normal"'),
        ),
    ],
)
def test_auto_axes_that_tool_or_file_do_not_allow(make_job, changes, pieces):
    with pytest.raises(JobError) as caught:
        Job.load(make_job(*changes))
    assert all(piece in str(caught.value) for piece in pieces), str(caught.value)


def test_a_mesh_in_place_of_a_job_is_told_what_to_do(tmp_path):
    with pytest.raises(JobError, match=r"part\.STL: this is a mesh, not a job.*`pentapod new part\.STL` writes a job"):
        Job.load(tmp_path / "part.STL")


def test_every_key_is_described_and_has_its_unit():
    unitless = {
        "mesh", "unit", "scale", "repair", "flip", "region_direction", "name", "file", "type", "strategy", "pattern",
        "mode", "compensation",
        "matrix", "component", "interpolation", "solver", "format", "direction", "line", "directions", "remedy", "up",
        "then", "setups", "weight_strokes", "weight_singularities", "weight_joints", "weight_bodies",
        "weight_stiffness",
        "entry", "fill", "upright", "curve", "form", "which", "laying", "centred", "text", "letter_spacing", "align",
        "towards", "effect", "levels", "threshold", "frame", "use", "waive", "lowest_share", "left_share",
        "rotary_axes", "tool", "coolant", "tool_number", "laser_power",
    }  # fmt: skip
    units = ("_mm", "_deg", "_mm_min", "_ms", "_s", "_n", "_mm_s2", "_mm_s3", "_deg_s", "_deg_s2", "_rpm")
    models = [table_model(name) for name in JobTables.model_fields if name != "toolpath"]
    for model in [*models, *(table_model("toolpath", name) for name in job_strategies())]:
        assert model.__doc__
        for key, field in model.model_fields.items():
            assert field.description, key
            assert key in unitless or key.endswith(units), key
