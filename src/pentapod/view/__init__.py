"""The live scene: machine, part and path in a browser; the part can be dragged about, and its margins follow.

`opened` and `study` compute, `motion` and `shapes` say what stands where; only `server` and what it draws with know
viser (the extra `view`).
"""

from pentapod.view.motion import Motion
from pentapod.view.opened import Opened, open_run
from pentapod.view.server import Viewer
from pentapod.view.study import Reach, Study

__all__ = ["Motion", "Opened", "Reach", "Study", "Viewer", "open_run"]
