"""Concave parts machined whole by bull-nose and flat ends with a fixed axis, measured by OpenCAMLib."""

import numpy as np
import pytest

pytest.importorskip("opencamlib")

import concave_parts
from left_by_ends import ReachableTips, gouges, left_by_end
from pentapod import RasterOptions
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.toolpath import toolpath_with_report

ENDS = {"bull": BullNose(3e-3, 1e-3, flute=15e-3), "flat": FlatEnd(3e-3, flute=15e-3)}
STEPOVER = 3e-3


@pytest.mark.slow
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("name", ["ribs", "stairs", "valley", "egg_crate"])
def test_what_is_left_is_what_the_end_cannot_reach(name, end):
    part, tool = concave_parts.mesh(name), ENDS[end]
    toolpath, _ = toolpath_with_report(part, tool, RasterOptions(stepover=STEPOVER), np.array([0.0, 0.0, 1.0]))
    reachable = ReachableTips(part, tool)
    left = left_by_end(reachable, reachable.samples(3000, steepest_deg=80.0), toolpath, STEPOVER)
    assert left.missed <= 1e-3
    # On smooth slopes such ends leave more between passes than the ball whose ridge is the bound.
    assert left.beyond <= 1e-3 or name == "egg_crate"
    assert left.lifts <= 1
    assert left.air <= 0.25 * left.cut
    assert gouges(part, tool, toolpath, 1.1e-5) == 0
