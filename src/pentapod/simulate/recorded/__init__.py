"""Recorded runs: logs of the legs, aligned with their program and compared with it."""

from pentapod.simulate.recorded.alignment import Alignment, align
from pentapod.simulate.recorded.comparison import compare
from pentapod.simulate.recorded.leg_errors import LegErrors
from pentapod.simulate.recorded.recorded_run import Hold, RecordedRun
from pentapod.simulate.recorded.run_log import RunLog, read_log

__all__ = ["Alignment", "Hold", "LegErrors", "RecordedRun", "RunLog", "align", "compare", "read_log"]
