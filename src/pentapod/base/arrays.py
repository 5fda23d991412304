"""Validation of array arguments: shape, finiteness, read-only copies."""

from __future__ import annotations

from functools import reduce
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.errors import ArrayError

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.intp]
Bools: TypeAlias = NDArray[np.bool_]

_Number = TypeVar("_Number", bound=np.generic)


def as_floats(value: ArrayLike, name: str, shape: tuple[int | None, ...] | None = None) -> Floats:
    """Return `value` as a finite float64 array, without a copy where none is needed.

    `shape` constrains the trailing axes: ``(None, 3)`` requires at least two axes, the last of length 3.
    Raises ArrayError with the shape received, or the index of the first non-finite entry.
    """
    array = as_batch(value, name, shape)
    if not np.isfinite(array).all():
        first = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ArrayError(f"{name} is not finite at index {first}", value=float(array[first]), expected="finite numbers")
    return array


def as_batch(value: ArrayLike, name: str, shape: tuple[int | None, ...] | None = None) -> Floats:
    """As `as_floats`, but NaN passes: for batches where NaN marks an element without a result."""
    try:
        array = np.asarray(value)
        array = array if np.iscomplexobj(array) else np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArrayError(f"{name} is not an array of numbers", expected=_words(shape)) from error
    if np.iscomplexobj(array):
        raise ArrayError(f"{name} is complex", expected="real numbers")
    if shape is not None:
        tail = array.shape[len(array.shape) - len(shape) :] if len(shape) else ()
        if array.ndim < len(shape) or any(w is not None and w != n for w, n in zip(shape, tail, strict=True)):
            raise ArrayError(f"{name} has shape {array.shape}", expected=_words(shape))
    return array


def frozen(
    value: ArrayLike, name: str, shape: tuple[int | None, ...] | None = None, kind: type[np.floating] = np.float64
) -> NDArray[Any]:
    """Return a finite, read-only copy of `value`: for frozen dataclasses. Raises ArrayError.

    An array that is read-only and owns its numbers is returned itself: those of another frozen dataclass are shared.
    kind: of its numbers.
    """
    if isinstance(value, np.ndarray) and value.dtype == kind and value.flags.owndata and not value.flags.writeable:
        as_floats(value, name, shape)
        return value
    array = as_floats(value, name, shape).astype(kind)
    array.flags.writeable = False
    return array


def read_only(array: NDArray[_Number]) -> NDArray[_Number]:
    """Return a read-only view of an array, of a copy where it is not contiguous.

    What callers may give in any layout, writable or not, goes to kernels like this: they are compiled only once.
    """
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def set_frozen(instance: object, **values: Any) -> None:
    """Assign attributes of a frozen dataclass in its own ``__post_init__``."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def _words(shape: tuple[int | None, ...] | None) -> str:
    if shape is None:
        return "an array of numbers"
    return "shape (..., " + ", ".join("N" if n is None else str(n) for n in shape) + ")"


def row_maxima(values: Floats) -> Floats:
    """Return the largest value (n,) of each row (n, k), k few: several times as quick as NumPy's own along rows."""
    return reduce(np.maximum, values.T)


def row_minima(values: Floats) -> Floats:
    """Return the smallest value (n,) of each row (n, k), k few, as `row_maxima`."""
    return reduce(np.minimum, values.T)


def row_lengths(vectors: Floats) -> Floats:
    """Return the lengths (...) of vectors (..., k), k few: NumPy's norm along the last axis, several times as quick."""
    return np.sqrt(reduce(np.add, np.moveaxis(np.square(vectors), -1, 0)))
