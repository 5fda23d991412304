"""The order of passes: every pass once, travel near the best there is, never below the bound."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.toolpath.linking.tour import tour, travel, travel_bound


def in_order(first, last, order, backwards):
    heads = np.where(backwards[:, None], last[order], first[order])
    tails = np.where(backwards[:, None], first[order], last[order])
    return heads, tails


def best_of_all(first, last):
    """The least travel over all orders and ways round."""
    best = np.inf
    for order in permutations(range(len(first))):
        for backwards in product([False, True], repeat=len(first)):
            best = min(best, travel(*in_order(first, last, np.array(order), np.array(backwards))))
    return best


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(2, 5))
def test_tour_of_a_few_lines_against_all_orders(seed, count):
    first, last = np.random.default_rng(seed).uniform(size=(2, count, 3))
    order, backwards = tour(first, last, reversible=True)
    assert sorted(order) == list(range(count))
    found, best = travel(*in_order(first, last, order, backwards)), best_of_all(first, last)
    assert travel_bound(first, last) <= best + 1e-9
    assert best - 1e-9 <= found <= 1.3 * best + 1e-9


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_tour_of_many_lines_is_near_the_bound(seed):
    random = np.random.default_rng(seed)
    first = random.uniform(size=(150, 3)) * [1, 1, 0]
    last = first + 0.05 * random.normal(size=(150, 3)) * [1, 1, 0]
    order, backwards = tour(first, last, reversible=True)
    assert sorted(order) == list(range(150))
    bound = travel_bound(first, last)
    assert bound <= travel(*in_order(first, last, order, backwards)) <= 1.7 * bound


def test_tour_reverses_no_line_that_is_not_reversible():
    random = np.random.default_rng(5)
    first, last = random.uniform(size=(2, 40, 3))
    order, backwards = tour(first, last, reversible=False)
    assert sorted(order) == list(range(40))
    assert not backwards.any()
    naive = travel(first, last)
    assert travel(first[order], last[order]) < 0.5 * naive


@pytest.mark.parametrize("count", [0, 1])
def test_travel_bound_of_no_line_and_of_one_is_zero(count):
    assert travel_bound(np.zeros((count, 3)), np.zeros((count, 3))) == 0.0
