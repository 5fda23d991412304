"""Small HTML tables for notebooks: escaped, without colours of their own, so they hold on light and dark ground."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_RULE = "border-bottom:1px solid color-mix(in srgb,currentColor 25%,transparent)"


def html_table(title: str, rows: Iterable[Sequence[object]], head: Sequence[str] = (), more: str = "") -> str:
    """Return a table as HTML, its text escaped. more: HTML that stands below it, as it is."""
    lines = [f'<tr style="{_RULE}">{_cells("th", head)}</tr>'] if head else []
    lines += [f'<tr style="{_RULE}">{_cells("td", row)}</tr>' for row in rows]
    table = f'<table style="border-collapse:collapse;background:none">{"".join(lines)}</table>'
    return f'<div style="color:inherit;background:none"><strong>{escape(title)}</strong>{table}{more}</div>'


def _cells(kind: str, texts: Sequence[object]) -> str:
    style = "text-align:left;padding:2px 10px 2px 0;background:none;color:inherit"
    return "".join(f'<{kind} style="{style}">{escape(str(text))}</{kind}>' for text in texts)
