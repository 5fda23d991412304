"""Problems of a file: gathered while it is read, told all at once."""

from __future__ import annotations

from dataclasses import dataclass, field

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.gcode.language.options import OPTIONS

_MOST_LINES = 6
"""Further lines that are named for one problem."""


@dataclass
class Problems:
    """Errors by what they say, each with the lines where it occurs again."""

    found: dict[tuple[str, str | None], ToolpathError] = field(
        default_factory=dict[tuple[str, str | None], ToolpathError]
    )
    again: dict[tuple[str, str | None], list[int]] = field(default_factory=dict[tuple[str, str | None], list[int]])

    def add(self, error: ToolpathError) -> None:
        """Add an error; of equal ones, the first is kept with the lines of the others."""
        key = (error.what, error.key)
        if key not in self.found:
            self.found[key] = error
            self.again[key] = []
        elif error.line is not None and error.line != self.found[key].line:
            self.again[key].append(error.line)

    def check(self) -> None:
        """Raise the first error, with the others in `others`, if there is one."""
        errors = [self._told(key) for key in list(self.found)[: OPTIONS.problems]]
        if errors:
            errors[0].add_others(errors[1:])
            raise errors[0]

    def _told(self, key: tuple[str, str | None]) -> ToolpathError:
        error, lines = self.found[key], sorted(set(self.again[key]))
        if not lines:
            return error
        named = ", ".join(str(line) for line in lines[:_MOST_LINES])
        more = f" and {len(lines) - _MOST_LINES} more" if len(lines) > _MOST_LINES else ""
        also = f"also in line{'s' if len(lines) > 1 else ''} {named}{more}"
        remedy = f"{error.remedy} ({also})" if error.remedy else also
        return ToolpathError(
            error.what, file=error.file, line=error.line, key=error.key, value=error.value, expected=error.expected,
            remedy=remedy,
        )  # fmt: skip
