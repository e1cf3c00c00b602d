"""The report of a study: one HTML file that needs nothing else."""

from chladni.viewers.report.writing import report_html, write_report

__all__ = ["report_html", "write_report"]
