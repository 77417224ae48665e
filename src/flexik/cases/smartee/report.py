"""The report of the SmartEE: what its page shows, from the files of the stages."""

from pathlib import Path

from flexik.cases.smartee import report_figures, report_starts, report_tables
from flexik.cases.smartee.report_results import PUBLISHED_FILE, Results, read
from flexik.cases.smartee.section import Section
from flexik.reporting.report import Content, made_from, write_report

TEMPLATE = Path(__file__).with_name("page.md.j2")


def report(section: Section) -> None:
    """Write reports/NAME from data/NAME."""
    sources = made_from(section, [PUBLISHED_FILE])
    record = section.data / "report.json"
    found = content(read(section))
    write_report(section.report, TEMPLATE, found, sources=sources, record=record)


def content(results: Results) -> Content:
    """Tables, figures, metrics and values of the page."""
    figures = Content(figures=report_figures.figures(results))
    return figures | report_tables.content(results) | report_starts.content(results)
