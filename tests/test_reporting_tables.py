"""Tables against values worked out by hand."""

import io

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.errors import DataError
from flexik.evaluation.errors import STATISTICS
from flexik.reporting.tables import (
    calibration_table,
    markdown,
    mesh_table,
    positioning_errors_table,
    write_table,
)

OURS = {
    "max_abs_dx": 0.05,
    "max_abs_dy": 0.1,
    "max_error": 0.11,
    "mean_abs_dx": 0.01,
    "mean_abs_dy": 0.02,
    "mean_error": 0.03,
    "n_conditions": 125,
    "n_failed": 2,
}


@pytest.fixture
def published():
    return pd.DataFrame(
        {"statistic": list(STATISTICS), "none": [40.0, 125, 88, 8, 25, 40], "combined": range(1, 7)}
    )


def test_markdown_of_numbers_texts_and_nothing():
    frame = pd.DataFrame(
        {
            "max |dX|": ["a|b", "c"],
            "R (mm)": [1.005, np.nan],
            "n": pd.Series([3, None], dtype=object),
        }
    )
    assert markdown(frame, 1, "A caption.", ["first", "second"]) == (
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
    write_table(tmp_path / "out" / "table.v1", frame, {"x": 0})
    csv = (tmp_path / "out" / "table.v1.csv").read_bytes()
    assert csv == b'name,x,y,n\n"a, b",3.142,0.00000,7\n'
    text = (tmp_path / "out" / "table.v1.md").read_text()
    assert "|   3 | 0.00 |   7 |" in text


def test_round_off_does_not_change_the_files(tmp_path):
    frame = pd.DataFrame({"x": [1.0, 2 / 3, 0.0], "y": [10.0, -20.0, 1e-17]})
    for name, noise in (("a", 0.0), ("b", 1e-13)):
        write_table(tmp_path / name, frame + noise)
    for suffix in (".csv", ".md"):
        first, second = ((tmp_path / name).with_suffix(suffix).read_bytes() for name in "ab")
        assert first == second


def test_nothing_is_written_if_a_number_is_infinite(tmp_path):
    frame = pd.DataFrame({"x": [1.0, np.inf]})
    with pytest.raises(DataError, match="column x"):
        write_table(tmp_path / "table", frame)
    with pytest.raises(DataError, match="'z'"):
        write_table(tmp_path / "table", frame[:1], {"z": 2})
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
    lines = markdown(frame).removesuffix("\n").split("\n")
    assert len(lines) == rows + 2
    assert {line.replace(r"\|", "").count("|") for line in lines} == {3}
    assert {len(line) for line in lines} == {len(lines[0])}
    for line, value in zip(lines[2:], values, strict=False):
        assert abs(float(line.split("|")[-2]) - value) <= 0.005 * (1 + 1e-9)


def test_positioning_errors_stand_beside_the_published_ones(published):
    table = positioning_errors_table(
        {"none": OURS, "combined_ga": OURS | {"mean_error": 0.004, "n_failed": 0}},
        published,
        {"combined_ga": "combined"},
    )
    assert list(table.columns) == [
        *("statistic", "none", "none published", "combined_ga", "combined_ga published")
    ]
    assert table["statistic"].tolist() == [
        *("max |dX| (mm)", "max |dY| (mm)", "max R (mm)"),
        *("mean |dX| (mm)", "mean |dY| (mm)", "mean R (mm)"),
        *("conditions", "failed conditions"),
    ]
    assert table["none"].tolist()[:6] == pytest.approx([50, 100, 110, 10, 20, 30])
    assert table["none"].tolist()[6:] == [125, 2]
    assert table["combined_ga"].tolist()[5] == pytest.approx(4.0)
    assert table["combined_ga published"].tolist() == [1, 2, 3, 4, 5, 6, None, None]
    last = markdown(table).splitlines()[-2:]
    assert [cell.strip() for cell in last[0].split("|")] == [
        "",
        "conditions",
        "125",
        "",
        "125",
        "",
        "",
    ]
    table = positioning_errors_table({"mine": OURS}, published, {"mine": None})
    assert table["mine"].tolist()[5] == pytest.approx(30.0)
    row = next(line for line in markdown(table).splitlines() if "mean R" in line)
    assert [cell.strip() for cell in row.split("|")] == ["", "mean R (mm)", "30.00", "", ""]
    less = {key: value for key, value in OURS.items() if key != "n_failed"}
    with pytest.raises(DataError, match="n_failed"):
        positioning_errors_table({"none": less}, published)


def test_calibration_differs_in_percent_of_the_published(published):
    table = calibration_table(OURS, published)
    assert table["difference (%)"].tolist() == pytest.approx([25, -20, 25, 25, -20, -25])
    assert table["ours"].tolist() == pytest.approx([50, 100, 110, 10, 20, 30])
    assert len(table) == 6


def test_mesh_table_is_in_mm_and_keeps_other_columns():
    frame = pd.DataFrame(
        {
            "refinement": [1, 2],
            "max_difference": [2e-4, 5e-5],
            "element": ["ancf", "ancf"],
            "mean_difference": [1e-4, 2e-5],
        },
        index=[5, 6],
    )
    table = mesh_table(frame)
    names = ["refinement", "max tip difference (mm)", "element", "mean tip difference (mm)"]
    assert list(table.columns) == names
    np.testing.assert_allclose(table[names[1::2]], [[0.2, 0.1], [0.05, 0.02]])
    assert frame["mean_difference"].tolist() == [1e-4, 2e-5]
    with pytest.raises(DataError, match="max_difference"):
        mesh_table(frame.drop(columns="max_difference"))


def test_csv_reads_back(tmp_path, published):
    write_table(tmp_path / "errors", positioning_errors_table({"none": OURS}, published))
    read = pd.read_csv(io.StringIO((tmp_path / "errors.csv").read_text()))
    assert read["none"].tolist() == [50, 100, 110, 10, 20, 30, 125, 2]
    assert read["none published"].isna().tolist() == [False] * 6 + [True] * 2
