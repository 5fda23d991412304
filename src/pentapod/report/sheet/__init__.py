"""The set-up sheet: one HTML file without script, a printed page for each set-up."""

from pentapod.report.sheet.page import write_sheet

__all__ = ["write_sheet"]
