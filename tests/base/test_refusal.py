"""Refusals: stages hand them on, and `unwrap` raises them."""

import pickle
from dataclasses import dataclass

import pytest

from pentapod.base import Refusal, RefusalError, Result, Shortfall, stage

REFUSED = Refusal(
    "placement", "it does not fit", (Shortfall("leg 2 too long", ((3, 5),), 1.5, "mm"),), "a smaller part"
)


@dataclass(frozen=True)
class Number(Result):
    of: int


@stage
def halved(number: Number, *, by: int = 2) -> Number | Refusal:
    """Return the half."""
    return Number(number.of // by) if number.of else Refusal("halving", "there is nothing")


def test_a_chain_of_stages_needs_one_unwrap():
    assert halved(halved(Number(12)), by=3).unwrap().of == 2
    assert halved(number=Number(4)) == Number(2)
    assert halved.__doc__ == "Return the half."


def test_a_stage_hands_a_refusal_on_unchanged():
    assert halved(REFUSED) is REFUSED
    assert halved(halved(Number(0))).cause == "there is nothing"


def test_unwrap_of_a_refusal_raises_it():
    with pytest.raises(
        RefusalError, match=r"placement: it does not fit: leg 2 too long by 1.5 mm at waypoints 3-5"
    ) as caught:
        halved(REFUSED).unwrap()
    assert caught.value.refusal is REFUSED
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.refusal == REFUSED
    assert str(again) == str(REFUSED)
