"""The report: one self-contained HTML page on a run."""

from pentapod.report.page import write_report

__all__ = ["write_report"]
