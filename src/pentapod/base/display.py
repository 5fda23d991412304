"""Display in notebooks and plots: HTML tables, matplotlib axes, and optional packages imported when used."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from importlib import import_module
from typing import Any

from pentapod.base.errors import InputError

RULE = "border-bottom:1px solid color-mix(in srgb,currentColor 25%,transparent)"


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


def html_table(title: str, rows: Iterable[Sequence[object]], head: Sequence[str] = (), more: str = "") -> str:
    """Return a table as HTML, text escaped, without colours of its own. more: HTML below the table."""
    lines = [f'<tr style="{RULE}">{_cells("th", head)}</tr>'] if head else []
    lines += [f'<tr style="{RULE}">{_cells("td", row)}</tr>' for row in rows]
    table = f'<table style="border-collapse:collapse;background:none">{"".join(lines)}</table>'
    return f'<div style="color:inherit;background:none"><strong>{escape(title)}</strong>{table}{more}</div>'


def _cells(kind: str, texts: Sequence[object]) -> str:
    style = "text-align:left;padding:2px 10px 2px 0;background:none;color:inherit"
    return "".join(f'<{kind} style="{style}">{escape(str(text))}</{kind}>' for text in texts)
