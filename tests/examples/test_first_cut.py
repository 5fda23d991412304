"""From crate to first cut: the calibrated, registered program on the true machine, and that of the design."""

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "15_from_crate_to_first_cut.py"


@pytest.mark.slow
def test_the_first_cut_is_where_the_toolpath_is(tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    designed, calibrated = runpy.run_path(str(EXAMPLE))["first_cut"](tmp_path, 117)
    assert calibrated < 25e-6
    assert designed > 1e-3
