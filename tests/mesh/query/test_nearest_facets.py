"""Nearest facets of points: against rational arithmetic on needles, and against all facets one by one."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from lengths import examples
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.kernels.ball_kernels import facet_distance
from pentapod.mesh.query.tree import FacetTree


def along(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def exact_distance(facet, point):
    """The distance of a point from a facet, from exact squares: the least of its plane and its three sides."""
    a, b, c, p = ([Fraction(float(v)) for v in corner] for corner in (*facet, point))
    squares = []
    for start, end in ((a, b), (b, c), (c, a)):
        side, way = minus(end, start), minus(p, start)
        whole = along(side, side)
        t = min(max(along(way, side) / whole, Fraction(0)), Fraction(1)) if whole else Fraction(0)
        off = [x - t * y for x, y in zip(way, side, strict=True)]
        squares.append(along(off, off))
    u, v, w = minus(b, a), minus(c, a), minus(p, a)
    uu, uv, vv, wu, wv = along(u, u), along(u, v), along(v, v), along(w, u), along(w, v)
    area = uu * vv - uv * uv
    if area:
        s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
        if s >= 0 and t >= 0 and s + t <= 1:
            off = [x - s * y - t * z for x, y, z in zip(w, u, v, strict=True)]
            squares.append(along(off, off))
    return math.sqrt(min(squares))


def needles(aspect, count, rng):
    """Facets of sides up to 100 mm, so many times longer than high, their corners in any order."""
    for _ in range(count):
        start, way = 0.1 * rng.normal(size=3), rng.normal(size=3)
        way *= rng.uniform(1e-3, 0.1) / np.linalg.norm(way)
        beside = np.cross(way, rng.normal(size=3))
        beside *= np.linalg.norm(way) / aspect / np.linalg.norm(beside)
        yield np.stack([start, start + way, start + rng.uniform(-0.2, 1.2) * way + beside])[rng.permutation(3)]


@pytest.mark.parametrize(
    ("aspect", "within"), [(1.0, 1e-15), (100.0, 1e-15), (1e3, 1e-14), (1e5, 1e-7), (np.inf, None)]
)
def test_distance_from_a_needle_is_that_of_exact_arithmetic_and_never_less(aspect, within):
    """Where a facet is no more than a line, rounding picks a place of it: a distance too large, not too small."""
    rng, g = np.random.default_rng(3), np.zeros(3)
    for facet in needles(aspect, 300, rng):
        way = rng.normal(size=3)
        point = rng.dirichlet([0.4] * 3) @ facet + 10.0 ** rng.uniform(-6, -2) * way / np.linalg.norm(way)
        found, exact = facet_distance(facet, *point, g), exact_distance(facet, point)
        assert found == pytest.approx(float(np.linalg.norm(g)), abs=1e-16)
        assert found > exact - 1e-15
        if within is not None:
            assert found < exact + within


def waves():
    """A sheet of thin facets, some 300 times as long as high, over waves that are concave and convex."""
    x, y = np.meshgrid(np.linspace(0.0, 0.06, 4), np.linspace(0.0, 0.04, 900), indexing="ij")
    vertices = np.stack([x, y, 3e-3 * np.sin(300.0 * y) + 2e-3 * np.cos(90.0 * x)], axis=-1).reshape(-1, 3)
    k = np.arange(x.size).reshape(x.shape)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    return Mesh.of(vertices, np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in ((a, b, c), (a, c, d))]))


def test_the_tree_finds_the_nearest_of_all_facets_up_to_any_distance():
    tree, rng = FacetTree.of(waves()), np.random.default_rng(4)
    points = rng.uniform([-0.01, -0.01, -0.01], [0.07, 0.05, 0.01], (examples(100, 300), 3))
    g = np.zeros(3)
    every = np.array([[facet_distance(facet, *point, g) for facet in tree.corners] for point in points])
    least = every.min(axis=1)
    for within in (np.inf, 4e-3, 1e-4, 0.0, -1e-3):
        distances, away, facets = tree.closest(points, within)
        near = least < within
        np.testing.assert_array_equal(facets >= 0, near)
        np.testing.assert_allclose(distances, np.where(near, least, within), atol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(away, axis=1), np.where(near, least, 0.0), atol=1e-15)
        np.testing.assert_allclose(every[near, facets[near]], least[near], atol=1e-15)
        np.testing.assert_array_equal(tree.within(points, within), near)


@pytest.mark.parametrize("length", [1e-4, 2e-3, 3e-2])
def test_a_chord_is_clear_where_no_sample_of_it_is_nearer(length):
    """Between two samples a chord is nearer than at both by at most half their distance."""
    tree, rng, steps = FacetTree.of(waves()), np.random.default_rng(5), 200
    starts = rng.uniform([-0.005, -0.005, -0.008], [0.065, 0.045, 0.008], (examples(300, 2000), 3))
    ways = rng.normal(size=starts.shape)
    ends = starts + length * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    shares = np.linspace(0.0, 1.0, steps + 1)[:, None, None]
    nearest = tree.closest((starts + shares * (ends - starts)).reshape(-1, 3))[0].reshape(steps + 1, -1).min(axis=0)
    for least in (5e-4, 2e-3, 5e-3):
        clear = tree.clear(starts, ends, least)
        assert not clear[nearest < least].any()
        assert clear[nearest - 0.5 * length / steps > least].all()
        assert 0 < clear.sum() < len(clear)
