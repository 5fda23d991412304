"""Long paths from disk to disk: the same bits as the whole at once."""

import numpy as np
import pytest
from test_core import problem

from pentapod.base.errors import InputError
from pentapod.timing.stored import StoredStages, fastest_stored
from pentapod.timing.topp.engine import fastest
from pentapod.timing.topp.stages import Failure, Stages


def stored(p, folder):
    return StoredStages.write(Stages.of(p["s"], p["first"], p["second"], p["ceiling"], p["offset"]), folder)


@pytest.mark.parametrize("block", [2, 7, 64, 1000, 10**6])
@pytest.mark.parametrize(("x_start", "x_end"), [(0.0, 0.0), (1e-3, 2e-3)])
def test_blocks_are_the_whole_bit_for_bit(tmp_path, block, x_start, x_end):
    p = problem(11, n=900)
    assert fastest_stored(stored(p, tmp_path), tmp_path / "x.npy", block=block, x_start=x_start, x_end=x_end) is None
    assert np.array_equal(np.load(tmp_path / "x.npy"), fastest(**p, x_start=x_start, x_end=x_end))
    assert sorted(f.name for f in tmp_path.iterdir()) == sorted(
        ["s.npy", "first.npy", "second.npy", "ceiling.npy", "offset.npy", "x.npy"]
    )


@pytest.mark.parametrize("cap", [1e-3, 1e9])
def test_several_processes_give_the_same_bits(tmp_path, cap):
    """With a cap every lead suffices; without one no block can be guessed, and each is done again."""
    p = problem(4, n=8000, cap=cap)
    assert fastest_stored(stored(p, tmp_path), tmp_path / "x.npy", block=1000, processes=2) is None
    assert np.array_equal(np.load(tmp_path / "x.npy"), fastest(**p))


def test_failures_are_those_of_the_whole(tmp_path):
    p = problem(11, n=900)
    for kwargs in ({"x_end": 1.9}, {"x_start": 1.9}):
        whole = fastest(**p, **kwargs)
        assert isinstance(whole, Failure)
        assert fastest_stored(stored(p, tmp_path), tmp_path / "x.npy", block=50, **kwargs) == whole
    p["ceiling"][400:403] = 0.0
    assert fastest_stored(stored(p, tmp_path), tmp_path / "x.npy", block=50) == fastest(**p)
    p["second"][700] = np.nan
    assert fastest_stored(stored(p, tmp_path), tmp_path / "x.npy", block=50).gridpoint == 700
    with pytest.raises(InputError):
        fastest_stored(stored(p, tmp_path), tmp_path / "x.npy", block=1)
