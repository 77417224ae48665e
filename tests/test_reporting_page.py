"""Report pages and named blocks."""

import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from flexik.errors import DataError
from flexik.reporting.blocks import replace_block
from flexik.reporting.page import Section, page
from flexik.reporting.tables import write_table

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
    ("text", "new", "message"),
    [
        ("nothing", "x", r"<!-- flexik:errors --> once, found it 0 times"),
        ("<!-- flexik:errors -->", "x", r"<!-- /flexik:errors --> once, found it 0 times"),
        (block("errors", "") * 2, "x", r"found it 2 times"),
        ("<!-- /flexik:errors --> <!-- flexik:errors -->", "x", r"<!-- /flexik:errors --> after"),
        (block("errors", ""), "<!-- /flexik:errors -->", r"holds the marker"),
        (block("other", ""), "x", r"flexik:errors"),
    ],
)
def test_wrong_markers_are_named(text, new, message):
    with pytest.raises(DataError, match=message):
        replace_block(text, "errors", new)


@pytest.fixture
def report(tmp_path):
    """Arguments of a page with a table and a figure whose name has a blank."""
    folder = tmp_path / "reports" / "crane"
    write_table(folder / "tables" / "errors", pd.DataFrame({"R": [1.0]}), caption="Errors.")
    figure = tmp_path / "reports" / "figures" / "the crane.png"
    figure.parent.mkdir()
    figure.write_bytes(b"")
    sections = [
        Section("Words", "Some text.\n"),
        Section("Errors", "", [folder / "tables" / "errors.md"], [(figure, "A [crane]")]),
    ]
    return folder / "README.md", sections


def test_page_is_assembled_in_order_with_relative_links(report):
    path, sections = report
    page(path, "Log crane", sections, {"grid": "b" * 64, "genetic": "a" * 64}, {"x.csv": "c" * 64})
    text = path.read_text()
    parts = [
        "# Log crane\n\n## Words\n\nSome text.\n\n## Errors\n\nErrors.\n\n|    R |\n",
        "[errors.csv](tables/errors.csv)",
        "![A (crane)](../figures/the%20crane.png)\n\n*A [crane]*",
        "## Provenance",
        f"| genetic    | `{'a' * 64}` |\n| grid       | `{'b' * 64}` |",
        f"| x.csv | `{'c' * 64}` |\n",
    ]
    places = [text.index(part) for part in parts]
    assert places == sorted(places) and places[0] == 0
    assert "\n\n\n" not in text and text.endswith("|\n")


def test_page_does_not_depend_on_the_order_of_checksums(report):
    path, sections = report
    page(path, "Log crane", sections, {"a": "1", "b": "2"}, {})
    first = path.read_bytes()
    page(path, "Log crane", sections, {"b": "2", "a": "1"}, {})
    assert path.read_bytes() == first


@pytest.mark.parametrize("missing", ["errors.md", "errors.csv", "the crane.png"])
def test_a_page_with_a_missing_part_is_not_written(report, tmp_path, missing):
    path, sections = report
    next(tmp_path.rglob(missing)).unlink()
    path.write_text("old")
    with pytest.raises(DataError, match=missing):
        page(path, "Log crane", sections, {}, {})
    assert path.read_text() == "old"
