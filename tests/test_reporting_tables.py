"""Tables against values worked out by hand."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.errors import DataError
from flexik.reporting.tables import Column, Table, mm, table


def test_markdown_of_numbers_texts_and_nothing():
    frame = pd.DataFrame(
        {
            "max |dX|": ["a|b", "c"],
            "R (mm)": [1.005, np.nan],
            "n": pd.Series([3, None], dtype=object),
        }
    )
    assert Table(frame, 1).markdown("A caption.", ["first", "second"]) == (
        "A caption.\n"
        "\n"
        "| max \\|dX\\| | R (mm) |   n |\n"
        "| ---------- | -----: | --: |\n"
        "| a\\|b       |    1.0 |   3 |\n"
        "| c          |        |     |\n"
        "\n"
        "- first\n"
        "- second\n"
    )


def test_csv_keeps_three_decimals_more_and_the_integers(tmp_path):
    frame = pd.DataFrame({"name": ["a, b"], "x": [np.pi], "y": [-1e-9], "n": [np.int64(7)]})
    Table(frame, {"x": 0}).write(tmp_path / "out" / "table.v1")
    csv = (tmp_path / "out" / "table.v1.csv").read_bytes()
    assert csv == b'name,x,y,n\n"a, b",3.142,0.00000,7\n'
    text = (tmp_path / "out" / "table.v1.md").read_text()
    assert "|   3 | 0.00 |   7 |" in text


def test_round_off_does_not_change_the_files(tmp_path):
    frame = pd.DataFrame({"x": [1.0, 2 / 3, 0.0], "y": [10.0, -20.0, 1e-17]})
    for name, noise in (("a", 0.0), ("b", 1e-13)):
        Table(frame + noise).write(tmp_path / name)
    for suffix in (".csv", ".md"):
        first, second = ((tmp_path / name).with_suffix(suffix).read_bytes() for name in "ab")
        assert first == second


def test_nothing_is_written_if_a_number_is_infinite(tmp_path):
    frame = pd.DataFrame({"x": [1.0, np.inf]})
    with pytest.raises(DataError, match="column x"):
        Table(frame).write(tmp_path / "table")
    with pytest.raises(DataError, match="'z'"):
        Table(frame[:1], {"z": 2}).write(tmp_path / "table")
    assert not list(tmp_path.iterdir())


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=5),
    st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\n"), max_size=6)),
)
def test_every_row_of_markdown_has_the_same_cells(values, names):
    rows = max(len(values), len(names))
    frame = pd.DataFrame(
        {
            "name": pd.Series(names + [""] * (rows - len(names)), dtype=object),
            "value": pd.Series(values + [None] * (rows - len(values)), dtype=object),
        }
    )
    lines = Table(frame).markdown().removesuffix("\n").split("\n")
    assert len(lines) == rows + 2
    assert {line.replace(r"\|", "").count("|") for line in lines} == {3}
    assert {len(line) for line in lines} == {len(lines[0])}
    for line, value in zip(lines[2:], values, strict=False):
        assert abs(float(line.split("|")[-2]) - value) <= 0.005 * (1 + 1e-9)


def test_a_table_of_columns_in_their_units():
    rows = [{"method": "a", "mean_error": 0.0012345, "n": 3}, {"method": "b", "n": 4}]
    made = table(rows, {"method": "method", "mean (mm)": mm("mean_error", 1), "n": "n"})
    assert made.csv == "method,mean (mm),n\na,1.2345,3\nb,,4\n"
    assert "| a      |       1.2 |   3 |" in made.markdown()
    assert table([], {"method": "method", "n": Column("n", 0)}).csv == "method,n\n"
    with pytest.raises(DataError, match="'p95'"):
        table(rows, {"p95": mm("p95")})
