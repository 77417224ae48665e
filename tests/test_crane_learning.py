"""What each kind of network learns, on a table made by hand."""

import crane_case
import numpy as np
import pandas as pd
import pytest
from crane_case import KINDS, MACHINE, SAMPLE_FIELDS

from flexik.cases.crane.parts.fields import on_line
from flexik.datasets.tables import write_table
from flexik.kinematics.crane import forward, inverse
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.learning.training import Architecture
from flexik.parameters.trainers import LevenbergMarquardt
from flexik.planar.fields import FAILED, KEPT, LEFT_OUT
from flexik.planar.learning import correction, error_at_tip, learnt_rows, lesson, on_branch

# Lift, jib, extension (m), payload (kg), deflection x, y (m), status
ROWS = np.array(
    [
        [0.2, 0.5, 0.4, 100.0, -0.002, -0.015, KEPT],
        [0.3, 0.4, 0.8, 50.0, -0.001, -0.010, KEPT],
        [0.3, 0.4, 0.8, 200.0, -0.004, -0.040, KEPT],
        [0.3, 0.4, 0.8, 500.0, np.nan, np.nan, FAILED],
        [0.3, 0.0, 0.8, 50.0, -0.002, -0.020, KEPT],  # stretched: (0.32, 0.04) has this tip too
        [0.535, 0.0, 0.8, 50.0, 0.003, -0.015, KEPT],  # the other pose needs a longer lift stroke
        [0.3, 0.78, 0.8, 50.0, np.nan, np.nan, LEFT_OUT],
        [0.535, 0.78, 1.6, 200.0, 0.001, -0.005, KEPT],  # folded: (0.15, 0.75) has this tip too
        [0.0, 0.4, 1.6, 200.0, -0.003, -0.050, KEPT],
    ]
)
USED = ROWS[ROWS[:, 6] == KEPT]
INVERTIBLE = USED[[0, 1, 2, 4, 6]]


class Linear:
    """Stands for a trained rigid network."""

    MATRIX = np.array([[1.0, 20.0], [-3.0, 2.0], [0.5, 0.25]])

    def predict(self, values):
        """Some tip."""
        return values @ self.MATRIX


def table_of(rows, geometry):
    rigid = forward(geometry, rows[:, :3])
    columns = [*rows[:, :4].T, *rigid.T, *(rigid + rows[:, 4:6]).T, rows[:, 6].astype(np.int64)]
    return pd.DataFrame(dict(zip((field.name for field in SAMPLE_FIELDS), columns, strict=True)))


@pytest.fixture(scope="module")
def learn(geometry, tmp_path_factory):
    """Lesson of a kind: grid of all rows, selection of the last two."""
    folder = tmp_path_factory.mktemp("samples")
    for name, rows in (("grid", ROWS), ("selection", ROWS[-2:])):
        table = table_of(rows, geometry)
        columns = {field.name: table[field.name].to_numpy() for field in SAMPLE_FIELDS}
        write_table(folder / f"{name}.parquet", columns, SAMPLE_FIELDS)

    def of(kind):
        return lesson(
            kind,
            Architecture(1),
            LevenbergMarquardt(),
            7,
            MACHINE,
            folder / "grid.parquet",
            folder / "selection.parquet",
            Linear() if kind == "correction" else None,
        )

    return of


def expected(kind, rows, geometry):
    """Inputs and outputs of `kind`, written out."""
    strokes, payload, bent = rows[:, :3], rows[:, 3:4], rows[:, 4:6]
    rigid = forward(geometry, strokes)
    loaded = np.hstack([strokes, payload])
    return {
        "deflection": (loaded, bent),
        "tip": (loaded, rigid + bent),
        "rigid_tip": (strokes, rigid),
        "correction": (loaded, rigid + bent - strokes @ Linear.MATRIX),
        "coordinates": (np.hstack([rigid + bent, payload, strokes[:, 2:]]), strokes[:, :2]),
    }[kind]


LEARNT = {
    "deflection": (USED, ROWS[-2:]),
    "tip": (USED, ROWS[-2:]),
    "rigid_tip": (USED[[0, 1, 3, 4, 5, 6]], ROWS[-2:]),  # each pose once
    "correction": (USED, ROWS[-2:]),
    "coordinates": (INVERTIBLE, ROWS[-1:]),
}


@pytest.mark.parametrize("kind", LEARNT)
def test_each_kind_has_its_inputs_and_outputs(learn, geometry, kind):
    found = learn(kind)
    training, selection = (expected(kind, rows, geometry) for rows in LEARNT[kind])
    assert found.inputs == pytest.approx(training[0], abs=1e-15)
    assert found.outputs == pytest.approx(training[1], abs=1e-15)
    assert found.selection[0] == pytest.approx(selection[0], abs=1e-15)
    assert found.selection[1] == pytest.approx(selection[1], abs=1e-15)
    for quantities, fields in (
        (found.input_quantities, KINDS[kind].inputs),
        (found.output_quantities, KINDS[kind].outputs),
    ):
        assert [(q.name, q.unit) for q in quantities] == [(f.name, f.unit) for f in fields]


class Strokes:
    """Gives these strokes whatever the inputs."""

    def __init__(self, strokes):
        self.strokes = strokes

    def predict(self, values):
        """Strokes, one row for each of `values`."""
        return np.broadcast_to(self.strokes, (len(values), 2))


def test_inverse_networks_are_judged_by_the_tip(learn, geometry):
    for kind in set(LEARNT) - {"coordinates"}:
        assert learn(kind).judge is None
    data = learn("coordinates")
    lift, jib, extension = ROWS[-1, :3]  # the one row of the selection
    assert data.judge(Strokes([lift, jib])) == 0.0
    tips = forward(geometry, USED[:, :3]) + USED[:, 4:6]
    reach = (tips.max(axis=0) - tips.min(axis=0)) / 2
    for other in ([lift + 1e-3, jib], [lift, jib - 2e-3]):
        ends = forward(geometry, np.array([[lift, jib, extension], [*other, extension]]))
        x, y = (ends[1] - ends[0]) / reach
        expected = np.sqrt((x**2 + y**2) / 2)
        assert data.judge(Strokes(other)) == pytest.approx(expected, rel=1e-9)
    # beyond its limits no stroke is commanded
    assert data.judge(Strokes([-0.1, jib])) == data.judge(Strokes([0.0, jib]))


def test_the_error_at_the_tip_is_a_mean_over_samples_and_axes(geometry):
    strokes = np.array([[0.2, 0.3], [0.4, 0.5]])
    inputs = np.array([[0.0, 0.0, 0.0, 0.8], [0.0, 0.0, 0.0, 1.6]])
    found = np.array([[0.21, 0.3], [0.4, 0.5]])  # the second is exact
    moved = forward(geometry, np.array([[0.21, 0.3, 0.8]])) - forward(
        geometry, np.array([[0.2, 0.3, 0.8]])
    )
    error = error_at_tip(
        CraneManipulator(geometry), inputs, strokes, np.array([2.0, 4.0]), Strokes(found)
    )
    squares = (moved[0] / [2.0, 4.0]) ** 2
    assert error == pytest.approx(np.sqrt(squares.sum() / 4), rel=1e-12)


def test_all_kinds_are_tested_and_name_their_columns():
    assert KINDS.keys() == LEARNT.keys()
    networks = crane_case.section().networks.values()
    assert {network.learns or "correction" for network in networks} >= set(KINDS)
    strokes = ["lift_stroke", "jib_stroke", "extension_stroke"]
    names = {
        kind: [[field.name for field in fields] for fields in (columns.inputs, columns.outputs)]
        for kind, columns in KINDS.items()
    }
    assert names == {
        "deflection": [[*strokes, "payload"], ["deflection_x", "deflection_y"]],
        "tip": [[*strokes, "payload"], ["tip_x", "tip_y"]],
        "rigid_tip": [strokes, ["rigid_x", "rigid_y"]],
        "correction": [[*strokes, "payload"], ["correction_x", "correction_y"]],
        "coordinates": [["tip_x", "tip_y", "payload", "extension_stroke"], strokes[:2]],
    }
    for columns in KINDS.values():
        for field in (*columns.inputs, *columns.outputs):
            assert field.unit == ("kg" if field.name == "payload" else "m")


def test_poses_on_the_branch_are_those_the_rigid_inverse_takes(geometry):
    table = table_of(ROWS, geometry)
    found = on_branch(table, MACHINE)
    assert found.tolist() == [True, True, True, True, False, True, True, False, True]
    # those that are not have a tip that other strokes have too
    for strokes in table.loc[~found, ["lift_stroke", "jib_stroke", "extension_stroke"]].to_numpy():
        tip = forward(geometry, strokes[None])
        other = inverse(geometry, tip, strokes[2]).values
        assert np.abs(other[0, :2] - strokes[:2]).max() > 0.01
        assert (other >= 0.0).all() and (other <= geometry.stroke_maximum).all()
        assert forward(geometry, other) == pytest.approx(tip, abs=1e-9)


def test_rows_learnt_are_whole_rows_of_the_table(geometry):
    table = table_of(USED, geometry)
    for kind, (rows, _) in LEARNT.items():
        found = learnt_rows(table, kind, MACHINE)
        assert np.array_equal(found, table_of(rows, geometry)), kind
    assert len(table) == len(USED)


def test_a_correction_is_what_the_network_lacks_of_the_tip(geometry):
    table = table_of(USED, geometry)
    strokes = USED[:, :3]
    tip = forward(geometry, strokes) + USED[:, 4:6]
    left = correction(table, MACHINE, Linear())
    assert np.array_equal(left, tip - Linear().predict(strokes))
    assert Linear().predict(strokes) + left == pytest.approx(tip, abs=1e-14)


def test_rows_on_a_line_have_its_strokes_and_payload(geometry):
    table = table_of(ROWS, geometry)
    assert on_line(table, 0.4, 0.8).tolist() == [False] + [True] * 3 + [False] * 5
    assert on_line(table, 0.4, 0.8, 200.0).tolist() == [False, False, True] + [False] * 6
    assert on_line(table, 0.4, 1.6).nonzero()[0].tolist() == [8]
    # as sums of increments differ from a written value
    assert (
        on_line(table, 0.1 + 0.3, 0.8000000000000002).tolist() == on_line(table, 0.4, 0.8).tolist()
    )
    assert not on_line(table, 0.41, 0.8).any()
