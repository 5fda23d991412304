"""Strategy: a way to machine a surface, with its options. Each stands in a file of its own, as `STRATEGY`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.drawing import Drawing
from pentapod.toolpath.options import PathOptions


@dataclass(frozen=True)
class Strategy(Value):
    """A way to machine a surface. draw: surface, tool and options → lines on it.

    options: a dataclass; its fields with a `Key` are the keys of [toolpath] in job files. in_jobs: whether job files
    can ask for it.
    """

    name: str
    options: type[PathOptions]
    draw: Callable[[Mesh, Tool, Any], Drawing]
    in_jobs: bool = True
