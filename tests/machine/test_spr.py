"""The 4-UPS+SPR machine's file: read, and wrong ones are one clear error."""

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.machine import Machine, read_machine
from pentapod.machine.reader import machine_bytes

TEXT = machine_bytes("spr").decode()


def test_geometry_is_that_of_the_file() -> None:
    robot = Machine.load("spr").robot
    np.testing.assert_allclose(robot.offsets, 1e-3 * np.array([38, -22, 93, 66, -135]))
    np.testing.assert_allclose(robot.arms[:4], np.hypot([0.034, 0.085, 0.056, 0.051], [0.110, 0.039, 0.003, 0.103]))
    assert robot.arms[4] == 0.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[51, -103], [0, 0]]", "[51, -103]]", "4 entries where there are five legs"),
        ("[51, -103], [0, 0]]", "[51, -103], [1, 0]]", "beside the tool axis"),
        ("home_mm = [6, 72, 351]\n", "", "home_mm"),
        ("home_mm = [6, 72, 351]", "home_mm = [6, 72, 351]\ndelta = 0.2", "no delta"),
    ],
)
def test_wrong_files_are_one_clear_error(old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(MachineError, match=words):
        read_machine(TEXT.replace(old, new), "mine.toml")
