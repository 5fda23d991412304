"""Numbers on the command line, by the rule for those in files: finite, decimal, in ASCII; 1_0 is none."""

from __future__ import annotations

import re
from typing import Any

import click

from pentapod.input_files import number_in

_WHOLE = re.compile(r"[+-]?[0-9]+", re.ASCII)


class Real(click.FloatRange):
    """A finite number, within bounds where they are given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; click tells what is wrong with any other text."""
        if isinstance(value, str) and number_in(value) is None:
            self.fail(f"{value!r} is not a finite decimal number.", param, ctx)
        return super().convert(value, param, ctx)


class Whole(click.IntRange):
    """A whole number, within bounds where they are given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; click tells what is wrong with any other text."""
        if isinstance(value, str) and not _WHOLE.fullmatch(value):
            self.fail(f"{value!r} is not a whole decimal number.", param, ctx)
        return super().convert(value, param, ctx)
