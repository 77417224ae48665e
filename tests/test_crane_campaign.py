"""A user's campaign: every mistake is named with its line; errors against hand calculation."""

import crane_case
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexik.errors import DataError
from flexik.evaluation.errors import STATISTICS
from flexik.kinematics.crane import forward
from flexik.planar.measured.campaign_file import (
    columns_of,
    coordinate_columns,
    own_campaign,
    read_campaign,
)
from flexik.planar.measured.errors import campaign_errors
from flexik.planar.measured.fields import campaign_fields, values_of

REFERENCE = crane_case.ROOT / "data/reference/crane"
MACHINE = crane_case.MACHINE
GEOMETRY, STROKES = crane_case.MANIPULATOR.geometry, values_of(MACHINE)
COLUMNS = columns_of(coordinate_columns(MACHINE))
GOOD = """\
# measured on a Sunday
method,target_x_m,target_y_m,payload_kg,measured_x_m,measured_y_m

none,3.8,0.15,0,3.795,0.141
combined,3.8,0.15,0,3.803,0.149
# with the log
none,3.8,0.15,86,3.791,0.131
combined, 3.8, 0.15, 86, 3.802, 0.1465
"""
STROKES_HEAD = (
    "lift_stroke_m,jib_stroke_m,extension_stroke_m,payload_kg,measured_x_m,measured_y_m\n"
)
STROKES_ALONE = f"""\
{STROKES_HEAD}0.2,0.3,0.4,0,4.5,1.2
0.2,0.3,0.4,0,4.5,1.21
"""


@pytest.fixture
def written(tmp_path):
    """File of a campaign with some text."""

    def write(text, encoding="utf-8"):
        path = tmp_path / "campaign.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write


def test_positioning_campaign(written):
    frame = read_campaign(written(GOOD), MACHINE)
    assert list(frame.columns) == [
        *("line", "method", "target_x", "target_y", "payload", "measured_x", "measured_y")
    ]
    assert frame["line"].tolist() == [4, 5, 7, 8]
    assert frame["method"].tolist() == ["none", "combined"] * 2
    np.testing.assert_array_equal(frame["payload"], [0, 0, 86, 86])
    np.testing.assert_array_equal(frame["measured_y"], [0.141, 0.149, 0.131, 0.1465])


def test_a_strokes_only_campaign_may_repeat_a_pose(written):
    frame = read_campaign(written(STROKES_ALONE), MACHINE)
    assert list(frame.columns) == ["line", "payload", *STROKES, "measured_x", "measured_y"]
    np.testing.assert_array_equal(frame["measured_y"], [1.2, 1.21])


def test_order_of_columns_line_ends_and_byte_order_mark_do_not_matter(written):
    lines = [line.split(",") for line in GOOD.splitlines() if line and line[0] != "#"]
    turned = "\r\n".join(",".join(reversed(cells)) for cells in lines)
    whole = read_campaign(written(turned, "utf-8-sig"), MACHINE).drop(columns="line")
    assert whole.equals(read_campaign(written(GOOD), MACHINE).drop(columns="line"))


def test_the_example_gives_both_tables():
    campaign = own_campaign(REFERENCE / "campaign_example.csv", MACHINE)
    assert {field.name for field in campaign_fields(MACHINE)} == set(campaign.columns)
    assert {name.removesuffix("_kg").removesuffix("_m") for name in COLUMNS} < set(campaign.columns)
    table = campaign_errors(campaign)
    assert table.groupby("method").size().to_dict() == {"none": 27, "combined": 27}
    means = table.groupby("method")[["error", "reference_error"]].mean()
    assert (means.loc["combined"] > 0.5e-3).all()
    assert (means.loc["combined"] < means.loc["none"]).all()
    assert (means.loc["none"] < 0.04).all()
    assert {(3.8, 0.15), (3.8, 0.95)} <= set(zip(table["target_x"], table["target_y"], strict=True))


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
def test_mistakes_are_named_with_file_and_line(written, old, new, line, message):
    assert old in GOOD
    with pytest.raises(DataError) as caught:
        read_campaign(written(GOOD.replace(old, new)), MACHINE)
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
        (STROKES_ALONE + "0.2,0.3,0.4,0,4.5,1.2\n", "line 4: expected each measurement once"),
        (STROKES_ALONE.replace("jib_stroke_m", "jib_stroke_cm"), "'jib_stroke_m' (its unit"),
        (GOOD.replace(",", ";"), "line 2: expected columns separated by commas"),
        (b"\xe4" + GOOD.encode(), "in UTF-8"),
        (None, "expected a CSV table"),
    ],
)
def test_files_that_are_no_campaign(tmp_path, text, message):
    path = tmp_path / "campaign.csv"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DataError, match=r"campaign\.csv") as caught:
        read_campaign(path, MACHINE)
    assert message in str(caught.value)


def test_an_own_campaign_may_leave_out_strokes_or_targets(written):
    table = own_campaign(written(GOOD), MACHINE)
    assert table[STROKES].isna().all(axis=None)
    assert table["target_x"].tolist() == [3.8] * 4
    x, y = forward(GEOMETRY, np.array([[0.3, 0.4, 0.5]]))[0]
    table = own_campaign(written(f"{STROKES_HEAD}# a comment\n0.3,0.4,0.5,0,{x},{y}\n"), MACHINE)
    assert table[["target_x", "target_y"]].isna().all(axis=None)
    assert table["method"].tolist() == [""]
    assert table["line"].tolist() == [3]
    assert table[STROKES].to_numpy().tolist() == [[0.3, 0.4, 0.5]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (STROKES_HEAD + "0.3,0.4,0.5,0,3.79,0.94\n", "expected a point within 0.5 m of where"),
        (STROKES_HEAD + "0.3,0.4,-0.5,0,3.79,0.94\n", "extension_stroke -0.5 m, expected 0 to 1.6"),
        (GOOD.replace("3.8", "8.2").replace("3.79", "8.19"), r"does not reach .*\(8.2, 0.15\)"),
    ],
)
def test_an_own_campaign_that_cannot_be_is_told(written, text, message):
    with pytest.raises(DataError, match=rf"campaign.csv, line [24]: .*{message}"):
        own_campaign(written(text), MACHINE)


TARGETS = np.array([[3.8, 0.15], [3.8, 0.15], [2.2, 0.95], [2.2, 0.95]])


def campaign(none, combined):
    """Two targets with 0 and 172 kg; errors (4, 2) in m of both methods."""
    reached = np.concatenate([TARGETS - none, TARGETS - combined])
    columns = ["target_x", "target_y", "measured_x", "measured_y"]
    frame = pd.DataFrame(np.hstack([np.tile(TARGETS, (2, 1)), reached]), columns=columns)
    payload = np.tile([0.0, 172.0], 4)
    return frame.assign(payload=payload, method=np.repeat(["none", "combined"], 4))


NONE = 1e-3 * np.array([[3.0, 4.0], [0.0, 12.0], [-5.0, 0.0], [8.0, 6.0]])
COMBINED = 1e-3 * np.array([[1.0, 0.0], [1.0, -2.0], [0.0, -3.0], [4.0, 0.0]])


def test_errors_count_from_the_target_and_from_the_unloaded_compensated_point():
    shuffled = campaign(NONE, COMBINED).iloc[[6, 0, 1, 2, 7, 3, 4, 5]]
    table = campaign_errors(shuffled)
    # rows by method, point and payload; points as they first come
    assert table["method"].tolist() == ["none"] * 4 + ["combined"] * 4
    assert table["point"].tolist() == [0, 0, 1, 1] * 2
    assert table["target_x"].tolist() == [2.2, 2.2, 3.8, 3.8] * 2
    rows = [2, 3, 0, 1, 6, 7, 4, 5]
    errors = table.set_index(pd.Index(rows)).sort_index().filter(like="error")
    millimetres = 1e3 * errors
    np.testing.assert_allclose(millimetres["error_x"], [3, 0, -5, 8, 1, 1, 0, 4], atol=1e-9)
    np.testing.assert_allclose(millimetres["error_y"], [4, 12, 0, 6, 0, -2, -3, 0], atol=1e-9)
    np.testing.assert_allclose(millimetres["error"][:4], [5, 12, 5, 10])
    # reference minus reached = (target - reached) - (target - reference)
    found = millimetres["reference_error_x"], millimetres["reference_error_y"]
    np.testing.assert_allclose(found[0], [2, -1, -5, 8, 0, 0, 0, 4], atol=1e-9)
    np.testing.assert_allclose(found[1], [4, 12, 3, 9, 0, -2, 0, 3], atol=1e-9)
    assert (millimetres["reference_error"][[4, 6]] == 0).all()


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-0.05, 0.05)] * 2), min_size=8, max_size=8).map(np.array),
    st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)
def test_a_misplaced_grid_does_not_touch_reference_errors(errors, shift):
    """A common shift of all measured points moves the errors, not those from the reference."""
    names = ["reference_error_x", "reference_error_y"]
    before, after = (
        campaign_errors(campaign(errors[:4] + by, errors[4:] + by))[names].to_numpy()
        for by in (np.zeros(2), np.array(shift))
    )
    np.testing.assert_allclose(after, before, atol=1e-12)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([0, 1, 4, 5, 2, 3, 7], r"target \(2.2, 0.95\) m with 0 kg by 'combined'"),
        ([*range(8), 0], "conditions twice"),
    ],
)
def test_spoilt_campaigns_are_refused(rows, message):
    with pytest.raises(DataError, match=message):
        campaign_errors(campaign(NONE, COMBINED).iloc[rows])


@pytest.mark.parametrize("name", ["measured_errors", "measured_reference_errors"])
def test_published_tables_agree_with_their_own_sums(name):
    """The transcription: nine points of each payload, so the mean over all is the mean of three."""
    table = pd.read_csv(REFERENCE / f"{name}.csv", index_col="statistic")
    assert list(table.index) == list(STATISTICS)
    for method in ("none", "combined"):
        single = table[[f"{method}_{payload}_kg" for payload in (0, 86, 172)]]
        whole = table[f"{method}_all"]
        means = [key for key in STATISTICS if key.startswith("mean")]
        np.testing.assert_allclose(single.mean(axis=1)[means], whole[means], atol=0.067)
        largest = {key: single.loc[key].max() for key in STATISTICS if key not in means}
        # 28.8 beside 28.9 mm, a slip of the thesis, is the one entry that cannot be
        slip = {"max_error"} if (name, method) == ("measured_errors", "none") else set()
        assert {key for key, value in largest.items() if value != whole[key]} == slip


def test_the_text_of_the_thesis_agrees_with_its_tables():
    both = {
        name: pd.read_csv(REFERENCE / f"{name}.csv", index_col="statistic")[
            ["none_all", "combined_all"]
        ].loc[["max_error", "mean_error"]]
        for name in ("measured_errors", "measured_reference_errors")
    }
    assert both["measured_errors"].to_numpy().tolist() == [[28.8, 16.6], [15.5, 10.7]]
    assert both["measured_reference_errors"].to_numpy().tolist() == [[27.5, 11.0], [10.6, 4.7]]
