"""Machines searched for by objectives and needs, and proven: `design_machines(DesignFile.load(path), folder)`.

The names below are imported when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pentapod.base.registry import imported_when_used

if TYPE_CHECKING:
    from pentapod.design.design_file import DesignFile as DesignFile
    from pentapod.design.members import Front as Front
    from pentapod.design.members import Member as Member
    from pentapod.design.members import Part as Part
    from pentapod.design.members import design_machines as design_machines
    from pentapod.design.output import write_front as write_front

_HOMES = {
    "design.design_file": "DesignFile",
    "design.members": "Front Member Part design_machines",
    "design.output": "write_front",
}

if not TYPE_CHECKING:  # type checkers read the imports above
    __getattr__, __dir__, __all__ = imported_when_used(__name__, _HOMES)
