"""Live viewer in a browser: machine, part and path; drag the part and see the margins of its new placement.

Only `server`, `scene`, `panel` and `access` use viser (extra `view`).
"""

from pentapod.view.motion import ToolMotion
from pentapod.view.opened_run import OpenedRun, open_run
from pentapod.view.server import Viewer
from pentapod.view.study import Reach, Study

__all__ = ["OpenedRun", "Reach", "Study", "ToolMotion", "Viewer", "open_run"]
