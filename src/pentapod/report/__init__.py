"""Reports: one self-contained HTML page on a run, a simulation, or a recorded run."""

from pentapod.report.page.page import write_report
from pentapod.report.simulated import write_recorded, write_simulation

__all__ = ["write_recorded", "write_report", "write_simulation"]
