"""Optional packages: loaded when they are used; what is missing is told with the extra that installs it."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from pentapod.base.errors import InputError


def load_extra(module: str, extra: str, what: str, **place: Any) -> Any:
    """Return an optional module. Raises InputError where it is not installed.

    extra: of pentapod, that installs it; what: the message, "frames need pandas"; place: keywords of InputError.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise InputError(what, remedy=f'pip install "pentapod[{extra}]"', **place) from error


def plot_axes(axes: Any, rows: int = 1, **subplot: Any) -> list[Any]:
    """Return matplotlib axes to draw into: those given, or of a new figure. Raises InputError without matplotlib."""
    pyplot = load_extra("matplotlib.pyplot", "plot", "plots need matplotlib", key="plot")
    if axes is not None:
        return list(axes) if isinstance(axes, list | tuple) or hasattr(axes, "ravel") else [axes]
    _, made = pyplot.subplots(
        rows, squeeze=False, sharex=rows > 1, layout="constrained", figsize=(7.0, 2.0 + 2.2 * rows), subplot_kw=subplot
    )
    return list(made[:, 0])
