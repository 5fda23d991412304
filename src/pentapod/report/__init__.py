"""Reports: one self-contained HTML page on a run, on its set-up for the operator, or on a simulation."""

from pentapod.report.page import write_report
from pentapod.report.sheet.page import write_sheet
from pentapod.report.simulated import write_simulation

__all__ = ["write_report", "write_sheet", "write_simulation"]
