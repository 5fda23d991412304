"""Live viewer in a browser: the report's page, on which the part can be dragged and planned again."""

from pentapod.view.opened_run import OpenedRun, open_run
from pentapod.view.server import Viewer
from pentapod.view.study import Reach, Study

__all__ = ["OpenedRun", "Reach", "Study", "Viewer", "open_run"]
