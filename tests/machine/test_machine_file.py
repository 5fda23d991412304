"""Machine files: what they mean, and one clear error for each thing that can be wrong."""

import re
import tomllib
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import MachineError
from pentapod.kinematics import GeneralPentapod
from pentapod.machine import Machine, load_machine, read_machine, shipped_machines

DESK = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
BASE = tomllib.loads(DESK)["geometry"]["base_mm"]


def replaced(key, value, text=DESK):
    """The file with another value for a key; None removes the key."""
    line = "" if value is None else f"{key} = {value}"
    new, count = re.subn(rf"(?m)^{key} = .*$", line, text)
    assert count == 1, key
    return new


def refusal(text):
    with pytest.raises(MachineError) as caught:
        read_machine(text, "my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml")
    assert "\n" not in message
    assert "pydantic" not in message
    return caught.value


def test_units_become_si():
    m = read_machine(DESK, "desk.toml")
    raw = tomllib.loads(DESK)
    np.testing.assert_array_equal(m.robot.base, np.array(raw["geometry"]["base_mm"]) / 1000)
    assert m.robot.delta == raw["geometry"]["delta"]
    np.testing.assert_array_equal(m.legs.max_jerk, np.full(5, raw["legs"]["max_jerk_mm_s3"] / 1000))
    assert m.rapid_velocity * 60000 == pytest.approx(raw["tool"]["rapid_mm_min"])
    assert m.bodies.leg_radius == raw["bodies"]["leg_diameter_mm"] / 2000
    np.testing.assert_allclose(np.degrees(m.joints.base_cone), raw["joints"]["base_cone_deg"])
    assert np.degrees(m.work.tilt) == pytest.approx(raw["work"]["tilt_deg"])
    np.testing.assert_allclose(np.linalg.norm(m.joints.base_axes, axis=1), 1.0, atol=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        m.legs.min_length[0] = 0.1


def test_limits_of_the_tool_are_optional_and_part_of_the_digest():
    plain = read_machine(DESK, "desk.toml")
    assert plain.tool_limits.given() == {}
    more = "max_tip_acceleration_mm_s2 = 1500\nmax_axis_velocity_deg_s = 90\n\n[controller]"
    m = read_machine(DESK.replace("[controller]", more), "desk.toml")
    assert m.tool_limits.given() == pytest.approx({"max_tip_acceleration": 1.5, "max_axis_velocity": np.pi / 2})
    assert m.digest != plain.digest


def test_loads_by_name_and_by_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(DESK, encoding="utf-8")
    assert load_machine("desk").digest == load_machine(path).digest == Machine.load(str(path)).digest
    assert "desk" in shipped_machines()


@pytest.mark.parametrize("name", shipped_machines())
def test_every_shipped_machine_loads_under_its_own_name(name):
    assert Machine.load(name).name == name


def test_five_numbers_or_one():
    five = read_machine(replaced("max_velocity_mm_s", "[100, 200, 300, 400, 500]"), "m").legs.max_velocity
    np.testing.assert_allclose(five, [0.1, 0.2, 0.3, 0.4, 0.5], rtol=1e-15)
    axes = read_machine(replaced("base_axis", "[0.6, 0, 0.8]"), "m").joints.base_axes
    np.testing.assert_allclose(axes, np.tile([0.6, 0, 0.8], (5, 1)), atol=1e-15)


def test_platform_alone_gives_the_same_machine():
    m = read_machine(DESK, "m")
    platform = [round(1000 * z, 7) for z in m.robot.offsets.tolist()]
    other = read_machine(replaced("delta", None).replace("[legs]", f"platform_mm = {platform}\n[legs]", 1), "m")
    # The insertion lands before the header of [legs], so still in [geometry].
    assert other.robot.delta == pytest.approx(m.robot.delta, rel=1e-6)
    np.testing.assert_allclose(other.robot.offsets, m.robot.offsets, atol=1e-9)
    both = read_machine(DESK.replace("[legs]", f"platform_mm = {platform}\n[legs]", 1), "m")
    np.testing.assert_allclose(both.robot.offsets, m.robot.offsets, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(
        ["min_length_mm", "max_jerk_mm_s3", "length_mm", "leg_diameter_mm", "period_ms", "height_mm", "delta"]
    ),
    st.floats(1e-6, 1e-3),
)
def test_digest_follows_the_numbers_alone(key, change):
    value = float(re.search(rf"(?m)^{key} = ([\d.]+)", DESK)[1])
    changed = read_machine(replaced(key, value * (1.0 + change)), "m")
    same = read_machine("# a comment\n" + DESK.replace('name = "desk"', 'name = "other"'), "elsewhere")
    digest = Machine.load("desk").digest
    assert re.fullmatch("[0-9a-f]{16}", digest)
    assert same.digest == digest
    assert changed.digest != digest


def test_another_tool_is_another_machine():
    m = Machine.load("desk")
    longer = m.with_tool(m.tool_length + 0.01)
    assert longer.digest != m.digest
    assert longer.with_tool(m.tool_length).digest == m.digest
    with pytest.raises(MachineError, match="too short"):
        m.with_tool(0.05)


def test_missing_file_lists_what_is_shipped(tmp_path):
    with pytest.raises(MachineError, match=r"no such machine.*shipped machines: .*desk"):
        Machine.load(tmp_path / "nothing.toml")
    with pytest.raises(MachineError, match='did you mean "desk"'):
        Machine.load("dsk")
    with pytest.raises(MachineError, match="this is a folder"):
        Machine.load(tmp_path)


def test_a_file_name_too_long():
    with pytest.raises(MachineError, match="file name too long"):
        Machine.load("x" * 300 + ".toml")


@pytest.mark.parametrize(("content", "words"), [(b"", "empty"), (b"  \n", "empty"), (b"\xff\xfe\x00binary", "UTF-8")])
def test_files_that_are_no_text(tmp_path, content, words):
    path = tmp_path / "m.toml"
    path.write_bytes(content)
    with pytest.raises(MachineError, match=words):
        Machine.load(path)


def test_syntax_error_has_line_and_column():
    line = DESK.splitlines().index("[tool]") + 1
    error = refusal(DESK.replace("[tool]", "[tool"))
    assert error.line == line
    assert error.column is not None
    assert str(error).startswith(f"my.toml:{line}:{error.column}")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            DESK.replace("max_velocity_mm_s =", "max_velocty_mm_s ="),
            ["legs.max_velocty_mm_s", "unknown key", '"max_velocity_mm_s"'],
        ),
        (DESK.replace("[controller]", "[controler]"), ["controler", "unknown table", '"controller"']),
        ("delta = 1\n" + DESK, ["delta", "unknown key"]),
        (replaced("length_mm", None), ["tool.length_mm", "missing"]),
        (DESK.replace("[work]", "[works]"), ["works", "unknown table", '"work"']),
        (DESK[: DESK.index("[work]")], ["work", "table is missing", "centre_mm"]),
        (replaced("name", None), ["name", "missing"]),
        (replaced("base_mm", str(BASE[:4])), ["geometry.base_mm", "4 entries where there are five legs"]),
        (replaced("base_mm", str([*BASE, [0, 0]])), ["6 entries"]),
        (replaced("base_mm", str([[1, 2, 3]] * 5)), ["geometry.base_mm", "entry 1 is not 2 finite numbers"]),
        (
            replaced("max_length_mm", "[900, 900, 900, 900]"),
            ["legs.max_length_mm", "4 numbers where there are five"],
        ),
        (replaced("min_length_mm", "2000"), ["legs.min_length_mm", "leg 1", "not below the longest"]),
        (
            replaced("min_length_mm", "[500, 500, 930, 500, 500]").replace("max_length_mm = 9", "max_length_mm = 8"),
            ["leg 3"],
        ),
        (replaced("max_velocity_mm_s", "nan"), ["legs.max_velocity_mm_s", "finite"]),
        (replaced("max_jerk_mm_s3", "inf"), ["legs.max_jerk_mm_s3", "finite"]),
        (replaced("delta", "nan"), ["geometry.delta", "finite"]),
        (replaced("max_acceleration_mm_s2", "0"), ["legs.max_acceleration_mm_s2", "positive"]),
        (replaced("max_acceleration_mm_s2", '"fast"'), ["legs.max_acceleration_mm_s2", "fast"]),
        (replaced("max_acceleration_mm_s2", "true"), ["legs.max_acceleration_mm_s2"]),
        (replaced("period_ms", "-1"), ["controller.period_ms", "greater than 0"]),
        (replaced("interpolation", '"quintic"'), ["controller.interpolation", "linear", "cubic"]),
        (replaced("base_axis", "[1, 1, 1]"), ["joints.base_axis", "unit vector"]),
        (replaced("base_cone_deg", "95"), ["joints.base_cone_deg", "90"]),
        (replaced("platform_min_deg", "120"), ["joints.platform_min_deg", "not a range"]),
        (replaced("centre_mm", "[0, 0]"), ["work.centre_mm"]),
        (replaced("tilt_deg", "90"), ["work.tilt_deg", "less than 90"]),
        (replaced("length_mm", "100"), ["tool.length_mm", "too short"]),
        (replaced("delta", None), ["geometry", "delta, or platform_mm"]),
        (replaced("delta", "0"), ["delta", "singular"]),
    ],
)
def test_what_is_wrong_is_named(text, parts):
    message = str(refusal(text))
    for part in parts:
        assert part in message


def test_keys_are_found_again_in_the_file():
    line = next(k for k, text in enumerate(DESK.splitlines(), 1) if text.startswith("period_ms"))
    assert refusal(replaced("period_ms", "0")).line == line
    # length_mm is a key of [tool] only, though others end like it
    line = next(k for k, text in enumerate(DESK.splitlines(), 1) if text.startswith("length_mm"))
    assert refusal(replaced("length_mm", "0")).line == line


def test_offsets_that_are_not_proportional():
    m = read_machine(DESK, "m")
    platform = (1000 * m.robot.offsets).tolist()
    platform[1] += 0.5
    claimed = refusal(DESK.replace("[legs]", f"platform_mm = {platform}\n[legs]", 1))
    assert "leg 2" in str(claimed)
    assert "+0.5 mm" in str(claimed)
    assert claimed.key == "geometry.platform_mm"
    alone = refusal(replaced("delta", None).replace("[legs]", f"platform_mm = {platform}\n[legs]", 1))
    assert "not of the quadratic family" in str(alone)
    assert 'family = "general"' in str(alone)


def test_general_family_takes_any_offsets():
    platform = [100, 30, -50, -120, 110]
    text = replaced("delta", None).replace("base_mm", f'family = "general"\nplatform_mm = {platform}\nbase_mm', 1)
    robot = read_machine(text, "m").robot
    np.testing.assert_allclose(robot.offsets, np.array(platform) * 1e-3, atol=1e-15)
    assert isinstance(robot, GeneralPentapod)
    assert read_machine(text, "m").digest != read_machine(DESK, "m").digest


def test_general_family_without_platform_or_with_delta_is_an_error():
    general = DESK.replace("base_mm", 'family = "general"\nbase_mm', 1)
    assert "general family has no delta" in str(refusal(general))
    missing = replaced("delta", None).replace("base_mm", 'family = "general"\nbase_mm', 1)
    assert "platform_mm with five numbers" in str(refusal(missing))


@pytest.mark.parametrize(
    "base",
    [
        [[-400, 100], [-100, 100], [200, 100], [400, 100], [0, -500]],  # four on a line
        [[-400, 100], [-100, 101], [200, 99], [400, 100.5], [0, -500]],  # almost
        [
            [-400, 160],
            [-300, 90],
            [0, 0],
            [200, 40],
            [400, 160],
        ],  # on the parabola y = x² / 1000: through (0, 1, 0)
        [[0, 0]] * 5,
    ],
)
def test_architecturally_singular_is_refused(base):
    small = refusal(replaced("base_mm", str(base)))
    assert "singular" in str(small)
    assert small.key == "geometry.base_mm"
