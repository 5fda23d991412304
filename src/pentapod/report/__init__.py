"""Reports: one self-contained HTML page on a run, or on a simulation."""

from pentapod.report.page.page import write_report
from pentapod.report.simulated import write_simulation

__all__ = ["write_report", "write_simulation"]
