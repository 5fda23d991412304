"""Numbers on the command line, by the rule for those in files: finite, decimal, in ASCII; 1_0 is none."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import click

from pentapod.base.files import number_in

_WHOLE = re.compile(r"[+-]?[0-9]+", re.ASCII)


class Real(click.FloatRange):
    """A finite number, within bounds where they are given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; click tells what is wrong with any other text."""
        if _is_other_text(value, lambda text: number_in(text) is not None):
            self.fail(f"{value!r} is not a finite decimal number.", param, ctx)
        return super().convert(value, param, ctx)


class Whole(click.IntRange):
    """A whole number, within bounds where they are given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; click tells what is wrong with any other text."""
        if _is_other_text(value, lambda text: _WHOLE.fullmatch(text) is not None):
            self.fail(f"{value!r} is not a whole decimal number.", param, ctx)
        return super().convert(value, param, ctx)


def _is_other_text(value: Any, is_number: Callable[[str], bool]) -> bool:
    """Return whether a value is text, not a default, and no number."""
    return isinstance(value, str) and not is_number(value)
