"""on_one_thread: linear algebra on one thread, so that its last bits do not depend on the number of threads.

On one kind of processor and with one set of libraries, that is: they choose the order of sums too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_R = TypeVar("_R")


def on_one_thread(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return the function with BLAS on one thread: on several it adds in another order, and last bits differ.

    The matrices of a plan are small; more threads gain nothing on them.
    """

    @wraps(function)
    def limited(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        from threadpoolctl import threadpool_limits  # noqa: PLC0415  only when planning

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
