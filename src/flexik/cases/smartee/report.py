"""The report of the SmartEE: what its page shows, from the files of the stages."""

from pathlib import Path

from flexik.cases.smartee import report_figures, report_starts, report_tables
from flexik.cases.smartee.report_results import PUBLISHED_FILE, Results, read
from flexik.cases.smartee.section import Section
from flexik.reporting.report import Content, made_from, write_report


def report(section: Section) -> None:
    """Write reports/smartee from data/smartee."""
    write(read(section), Path("reports/smartee"), Path("data/smartee/report.json"))


def write(results: Results, folder: Path, record: Path) -> None:
    """Write the report of `results` into `folder`."""
    content = Content(figures=report_figures.figures(results))
    content |= report_tables.content(results) | report_starts.content(results)
    sources = made_from(results.section, [PUBLISHED_FILE])
    template = Path(__file__).with_name("page.md.j2")
    write_report(folder, template, content, sources=sources, record=record)
