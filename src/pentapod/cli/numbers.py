"""Types of numbers on the command line: finite, decimal, ASCII; 1_0 is no number, as in files."""

from __future__ import annotations

import re
from typing import Any

import click

from pentapod.base.files import number_in

_WHOLE = re.compile(r"[+-]?[0-9]+", re.ASCII)


class Real(click.FloatRange):
    """A finite number, within bounds where they are given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number of a text."""
        given: Any = value
        if isinstance(value, str) and number_in(value) is None:
            self.fail(f"{value!r} is not a finite decimal number.", param, ctx)
        return super().convert(given, param, ctx)


class Whole(click.IntRange):
    """A whole number, within bounds where they are given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number of a text."""
        given: Any = value
        if isinstance(value, str) and not _WHOLE.fullmatch(value):
            self.fail(f"{value!r} is not a whole decimal number.", param, ctx)
        return super().convert(given, param, ctx)
