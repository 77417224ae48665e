"""The table of all cases in the README."""

from flexik.reporting.overview import ABSENT, ENTRIES, NOT_AVAILABLE, overview

JOINTS = {f"config{c}.joint{k}_error_percent": float(c * k) for c in (1, 2) for k in range(1, 7)}
METRICS = {
    case: {entry.metric: 0.001 for entry in ENTRIES if entry.case == case}
    for case in ("crane", "elastic_arm", "smartee")
} | {"fanuc": JOINTS}
PUBLISHED = {
    entry.published: 0.003 for entry in ENTRIES if entry.published not in (None, NOT_AVAILABLE)
}


def cells(table, what):
    (row,) = (line for line in table.splitlines() if f" {what} " in line)
    return [cell.strip() for cell in row.strip("|").split("|")][2:]


def test_values_stand_beside_the_published_in_the_unit_of_the_row():
    table = overview(METRICS, PUBLISHED)
    assert cells(table, "peak elbow error (mrad)") == ["3", "1.00"]
    assert cells(table, "mean error, `combined` (mm)") == ["0.003", "0.00"]
    assert cells(table, "mean tip error without gauges, `combined` (mm)") == ["", "0.00"]
    # means over the joints: 3.5 and 7
    one, all_ = "one network a joint", "one network for all"
    assert cells(table, f"total error of the joints, {one} (%)") == [NOT_AVAILABLE, "3.50"]
    assert cells(table, f"total error of the joints, {all_} (%)") == [NOT_AVAILABLE, "7.00"]
    assert len(table.strip().splitlines()) == 2 + len(ENTRIES)


def test_a_metric_that_a_run_lacks_is_told():
    fewer = {name: value for name, value in JOINTS.items() if "config1.joint6" not in name}
    table = overview(METRICS | {"fanuc": fewer}, PUBLISHED)
    one, all_ = "one network a joint", "one network for all"
    assert cells(table, f"total error of the joints, {one} (%)") == [NOT_AVAILABLE, ABSENT]
    assert cells(table, f"total error of the joints, {all_} (%)") == [NOT_AVAILABLE, "7.00"]
