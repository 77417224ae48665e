"""The blocks of README.md: the table of all cases, and named blocks in general."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from flexik.errors import DataError
from flexik.files import write_json
from flexik.reporting import overview
from flexik.reporting.overview import ABSENT, replace_block, update

TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\r"))
NAME = st.from_regex(r"[a-z][a-z-]{0,10}", fullmatch=True)


def block(name, content):
    return f"<!-- flexik:{name} -->{content}<!-- /flexik:{name} -->"


@given(TEXT, TEXT, TEXT, TEXT, NAME)
def test_only_the_block_changes(before, old, after, new, name):
    assume(not any("flexik:" in part for part in (before, old, after, new)))
    text = before + block(name, old) + after
    once = replace_block(text, name, new)
    assert once.startswith(f"{before}<!-- flexik:{name} -->\n")
    assert once.endswith(f"\n<!-- /flexik:{name} -->{after}")
    inside = once.removeprefix(f"{before}<!-- flexik:{name} -->")
    inside = inside.removesuffix(f"<!-- /flexik:{name} -->{after}")
    assert inside.strip("\n") == new.strip("\n")
    assert replace_block(once, name, new) == once


@given(TEXT, TEXT)
def test_other_blocks_stay(first, second):
    assume("flexik:" not in first + second)
    text = block("a", "") + block("b", "kept")
    changed = replace_block(replace_block(text, "a", first), "b", second)
    swapped = replace_block(replace_block(text, "b", second), "a", first)
    assert changed == swapped
    assert replace_block(text, "a", first).endswith(block("b", "kept"))


@pytest.mark.parametrize(
    ("text", "new"),
    [
        ("nothing", "x"),
        ("<!-- flexik:errors -->", "x"),
        (block("errors", "") * 2, "x"),
        ("<!-- /flexik:errors --> <!-- flexik:errors -->", "x"),
        (block("errors", ""), "<!-- /flexik:errors -->"),
        (block("other", ""), "x"),
    ],
)
def test_wrong_markers_are_named(text, new):
    with pytest.raises(DataError, match=r"<!-- flexik:errors --> and then <!-- /flexik:errors -->"):
        replace_block(text, "errors", new)


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Make a case of three rows, a published value and a table."""
    for name, folder in (("REPORTS", "reports"), ("REFERENCE", "reference"), ("CASES", "cases")):
        (tmp_path / folder / "arm").mkdir(parents=True)
        monkeypatch.setattr(overview, name, tmp_path / folder)
    rows = [
        "case,what,metric,form,scale,published,spread",
        "[arm](x.md),peak (mrad),net.peak_rad,.2f,1000,peaks.csv elbow peak 1000,",
        "[arm](x.md),mean of joints (%),joint*_percent,.1f,1,not available,",
        "[arm](x.md),of starts (mrad),net.peak_rad,.2f,1000,,net.least_rad net.largest_rad",
    ]
    (tmp_path / "cases/arm/overview.csv").write_text("\n".join(rows))
    (tmp_path / "reference/arm/peaks.csv").write_text("quantity,unit,peak\nelbow,rad,3e-3\n")
    (tmp_path / "reports/arm/errors.md").write_text("| a |\n")
    metrics = {"net.peak_rad": 0.00177, "joint1_percent": 1.0, "joint2_percent": 2.0}
    metrics |= {"net.least_rad": 0.0015, "net.largest_rad": 0.0042}
    write_json(tmp_path / "reports/arm/metrics.json", metrics)
    readme = tmp_path / "README.md"
    readme.write_text(block("overview", "old") + block("arm/errors", "old"))
    return readme


def cells(text, what):
    (row,) = (line for line in text.splitlines() if f" {what} " in line)
    return [cell.strip() for cell in row.strip("|").split("|")][2:]


def test_values_stand_beside_the_published_in_the_unit_of_the_row(project):
    update(project)
    text = project.read_text()
    assert cells(text, "peak (mrad)") == ["3", "1.77"]
    assert cells(text, "mean of joints (%)") == ["not available", "1.5"]
    assert "| a |" in text and "old" not in text


def test_the_spread_follows_in_brackets_where_the_run_has_it(project):
    update(project)
    assert cells(project.read_text(), "of starts (mrad)") == ["", "1.77 (1.50 to 4.20)"]
    metrics = {"net.peak_rad": 0.00177, "net.least_rad": 0.0015}
    write_json(project.with_name("reports") / "arm/metrics.json", metrics)
    update(project)
    assert cells(project.read_text(), "of starts (mrad)") == ["", "1.77"]
    write_json(project.with_name("reports") / "arm/metrics.json", {})
    update(project)
    assert cells(project.read_text(), "of starts (mrad)") == ["", ABSENT]


def test_rows_without_the_column_have_no_spread(project):
    file = project.with_name("cases") / "arm/overview.csv"
    rows = [line.rsplit(",", 1)[0] for line in file.read_text().splitlines()]
    file.write_text("\n".join(rows))
    update(project)
    assert cells(project.read_text(), "of starts (mrad)") == ["", "1.77"]


def test_a_metric_that_a_run_lacks_is_told(project):
    write_json(project.with_name("reports") / "arm/metrics.json", {})
    update(project)
    assert cells(project.read_text(), "peak (mrad)") == ["3", ABSENT]


def test_a_missing_table_is_named(project):
    (project.with_name("reports") / "arm/errors.md").unlink()
    with pytest.raises(DataError, match=r"errors\.md"):
        update(project)
