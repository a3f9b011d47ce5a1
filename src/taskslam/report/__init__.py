"""Figures, tables and one self-contained page."""

from taskslam.report.page.page import write_report

__all__ = ["write_report"]
