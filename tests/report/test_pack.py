"""Arrays of a page: what is packed is read again, exact to half a step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from page_arrays import arrays_of
from pentapod.cli.commands.new import dome_stl
from pentapod.report.pack import Packed, by_first_use
from pentapod.report.series import bucket_places, extremes
from pentapod.toolpath import load_mesh


@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=60), st.sampled_from([None, 0.01, 3.0]))
def test_numbers_are_exact_to_half_a_step(values, step):
    packed = Packed()
    packed.numbers("before", [[1.0, 2.0], [3.0, np.nan]])
    packed.numbers("values", values, step)
    found = arrays_of(packed.directory, packed.block)
    own = packed.directory["values"]["step"][0]
    assert step is None or own == step
    assert np.abs(found["values"][:, 0] - values).max() <= 0.5001 * own + 1e-12
    assert found["before"][:, 0] == pytest.approx([1.0, 3.0])
    assert np.isnan(found["before"][1, 1])


@given(st.lists(st.integers(0, 2**32 - 1), min_size=0, max_size=60))
def test_whole_numbers_are_exact(values):
    packed = Packed()
    packed.whole("values", values)
    assert arrays_of(packed.directory, packed.block)["values"][:, 0].tolist() == values


def test_a_mesh_packs_as_well_when_its_facets_are_in_disorder(tmp_path):
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=60))
    mesh = load_mesh(tmp_path / "part.stl", "mm")
    random = np.random.default_rng(3)
    shuffled = mesh.faces[random.permutation(len(mesh.faces))]
    sizes = []
    for faces in (mesh.faces, shuffled):
        packed = Packed()
        packed.mesh("part", 1e3 * mesh.vertices, faces)
        sizes.append(len(packed.block) / len(faces))
        found = arrays_of(packed.directory, packed.block)
        corners = found["part.vertices"][found["part.faces"].astype(int)].reshape(-1, 9)
        wanted = (1e3 * mesh.vertices)[faces].reshape(-1, 9)
        order = [np.lexsort(np.round(each, 1).T) for each in (corners, wanted)]
        assert np.abs(corners[order[0]].mean(axis=0) - wanted[order[1]].mean(axis=0)).max() < 0.003
        assert len(corners) == len(wanted)
    assert max(sizes) < 6.0, "bytes a facet"
    plain = Packed()
    plain.numbers("vertices", 1e3 * by_first_use(mesh.vertices, shuffled)[0], 0.005)
    plain.whole("faces", by_first_use(mesh.vertices, shuffled)[1])
    assert sizes[1] * len(shuffled) < 0.75 * len(plain.block)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=400), st.integers(1, 30))
def test_buckets_keep_extremes(values, buckets):
    array = np.array(values)[:, None]
    shown = extremes(array, buckets)
    assert shown.min() == array.min()
    assert shown.max() == array.max()
    assert len(shown) <= 2 * buckets
    places = bucket_places(np.arange(len(array), dtype=float), buckets)
    assert len(places) == len(shown)
    assert (np.diff(places) >= 0.0).all()


def test_a_peak_of_one_row_is_in_its_bucket():
    values = np.sin(np.arange(1_000_000) / 300.0)[:, None]
    values[777_777] = 9.0
    shown = extremes(values, 5000)
    assert len(shown) == 10_000
    assert bucket_places(np.arange(1e6), 5000)[shown[:, 0].argmax()] == pytest.approx(777_777, abs=200)
