"""A user's campaign: the example is read, and every mistake is named with its line."""

from pathlib import Path

import numpy as np
import pytest

from flexik.datasets.crane_measured.campaign import COLUMNS, read_campaign
from flexik.errors import DataError
from flexik.evaluation.crane_measured.campaign import (
    campaign_table,
    reference_errors,
    split_campaign,
)

EXAMPLE = Path(__file__).resolve().parents[1] / "data/reference/crane/campaign_example.csv"
GOOD = """\
# measured on a Sunday
method,target_x_m,target_y_m,payload_kg,measured_x_m,measured_y_m

none,3.8,0.15,0,3.795,0.141
combined,3.8,0.15,0,3.803,0.149
# with the log
none,3.8,0.15,86,3.791,0.131
combined, 3.8, 0.15, 86, 3.802, 0.1465
"""
STROKES = """\
lift_stroke_m,jib_stroke_m,extension_stroke_m,payload_kg,measured_x_m,measured_y_m
0.2,0.3,0.4,0,4.5,1.2
0.2,0.3,0.4,0,4.5,1.21
"""


@pytest.fixture
def read(tmp_path):
    """Read a campaign from its text."""

    def from_text(text, encoding="utf-8"):
        path = tmp_path / "campaign.csv"
        path.write_bytes(text.encode(encoding))
        return read_campaign(path)

    return from_text


def test_positioning_campaign(read):
    frame = read(GOOD)
    assert list(frame.columns) == [
        *("line", "method", "target_x", "target_y", "payload", "measured_x", "measured_y")
    ]
    assert frame["method"].tolist() == ["none", "combined"] * 2
    np.testing.assert_array_equal(frame["payload"], [0, 0, 86, 86])
    np.testing.assert_array_equal(frame["measured_y"], [0.141, 0.149, 0.131, 0.1465])
    assert frame.index.tolist() == [0, 1, 2, 3]


def test_a_strokes_only_campaign_may_repeat_a_pose(read):
    frame = read(STROKES)
    strokes = ["lift_stroke", "jib_stroke", "extension_stroke"]
    assert list(frame.columns) == ["line", "payload", *strokes, "measured_x", "measured_y"]
    np.testing.assert_array_equal(frame["measured_y"], [1.2, 1.21])


def test_order_of_columns_line_ends_and_byte_order_mark_do_not_matter(read):
    lines = [line.split(",") for line in GOOD.splitlines() if line and line[0] != "#"]
    turned = "\r\n".join(",".join(reversed(cells)) for cells in lines)
    whole = read(turned, "utf-8-sig").drop(columns="line")
    assert whole.equals(read(GOOD).drop(columns="line"))


def test_example_gives_both_tables():
    campaign = read_campaign(EXAMPLE)
    plain = [name.removesuffix("_kg").removesuffix("_m") for name in COLUMNS]
    assert list(campaign.columns) == ["line", *plain]
    frames = split_campaign(campaign)
    assert len(frames["none"]) == len(frames["combined"]) == 27
    targets = set(zip(campaign["target_x"], campaign["target_y"], strict=True))
    assert {(3.8, 0.15), (3.8, 0.95), (3.0, 0.95)} <= targets
    table, reference = campaign_table(frames), campaign_table(reference_errors(frames))
    for found in (table, reference):
        without, compensated = found.loc["mean_error", ["none_all", "combined_all"]]
        assert 0.5 < compensated < without < 40
    assert reference.loc["max_error", "combined_0_kg"] == 0


MISTAKES = {
    "no column": ("payload_kg,", "", 2, "expected the columns ['payload_kg'] too"),
    "half a group": ("method,", "", 2, "together, but ['method'] missing"),
    "wrong unit": ("target_x_m", "target_x_mm", 2, "expected as column 'target_x_m' (its unit"),
    "no unit": ("payload_kg", "payload", 2, "expected as column 'payload_kg' (its unit"),
    "unknown": ("payload_kg", "weather", 2, "expected as column one of ['method',"),
    "column twice": ("measured_y_m", "measured_x_m", 2, "once, got ['measured_x_m']"),
    "text": ("3.795", "3.7g5", 4, "column measured_x_m: expected a number, got '3.7g5'"),
    "empty cell": ("3.795", "", 4, "column measured_x_m: expected a number, got ''"),
    "not finite": ("3.795", "nan", 4, "column measured_x_m: expected a number, got 'nan'"),
    "underscore": ("3.795", "3_795", 4, "column measured_x_m: expected a number, got '3_795'"),
    "decimal comma": ("3.795", "3,795", 4, "expected 6 cells separated by commas, as in line 2"),
    "negative load": (",86,3.791", ",-86,3.791", 7, "column payload_kg: expected 0 to 100000 kg"),
    "millimetres": ("3.795", "3795", 4, "column measured_x_m: expected -50 to 50 m, got 3795"),
    "far away": ("3.795", "8.795", 4, "within 0.5 m of its target, got one 5 m away"),
    "method": ("none,3.8,0.15,86", "None,3.8,0.15,86", 7, "['none', 'combined'], got 'None'"),
    "twice": ("none,3.8,0.15,86", "none,3.8,0.15,0", 7, "payload are those of line 4"),
    "no counterpart": ("none,3.8,0.15,86", "none,3.8,0.15,172", 7, "172 kg and method 'combined'"),
    "no reference": ("0.15,0,", "0.15,5,", 4, "0 kg and method 'combined' for the target (3.8,"),
}


@pytest.mark.parametrize(("old", "new", "line", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_named_with_file_and_line(read, old, new, line, message):
    assert old in GOOD
    with pytest.raises(DataError) as caught:
        read(GOOD.replace(old, new))
    assert "campaign.csv, line " in str(caught.value)
    assert f"campaign.csv, line {line}" in str(caught.value)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a line of column names"),
        ("# only a comment\n", "expected a line of column names"),
        (GOOD.splitlines()[1], "and one or more of measurements"),
        ("payload_kg,measured_x_m,measured_y_m\n0,1,1\n", "line 1: expected the columns ['method'"),
        (STROKES + "0.2,0.3,0.4,0,4.5,1.2\n", "line 4: expected each measurement once"),
        (STROKES.replace("jib_stroke_m", "jib_stroke_cm"), "'jib_stroke_m' (its unit"),
        (GOOD.replace(",", ";"), "line 2: expected columns separated by commas"),
    ],
)
def test_files_that_are_no_campaign(read, text, message):
    with pytest.raises(DataError, match=r"campaign\.csv") as caught:
        read(text)
    assert message in str(caught.value)


def test_strokes_alone_tell_no_errors(read):
    with pytest.raises(DataError, match="'method', 'target_x', 'target_y'"):
        split_campaign(read(STROKES))


def test_missing_and_foreign_files(tmp_path, read):
    with pytest.raises(DataError, match=r"nowhere\.csv: expected a CSV table"):
        read_campaign(tmp_path / "nowhere.csv")
    with pytest.raises(DataError, match="in UTF-8"):
        read("\xe4" + GOOD, "latin-1")
