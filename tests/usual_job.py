"""The job that most tests begin with."""

import numpy as np

from pentapod.machine.machine import Machine

JOB = """\
[part]
mesh = "part.stl"
unit = "mm"

[machine]
name = "desk"

[tool]
type = "ball"
diameter_mm = 10

[toolpath]
stepover_mm = 15
spacing_mm = 4

[axis]
tilt_deg = 0

[feed]
cut_mm_min = 3000

[tolerance]
path_mm = 0.05
left_share = 1

[placement]
mode = "fixed"
position_mm = {position}
rotation_deg = [180, 0, 0]
component = "++"
"""


def job_text() -> str:
    """The part in the middle of the work volume, its top towards the base: nothing is left to search for.

    Its few passes are quick to plan; they are wider apart than the cutter, and may leave what they leave.
    """
    centre = Machine.load("desk").work.centre * 1e3
    return JOB.format(position=np.round(centre, 3).tolist())
