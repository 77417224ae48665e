"""Readings of the elastic arm, its gauges, and what networks learn from."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from elastic_arm import ARM, GEOMETRY, MODEL, ROOT

from flexik.datasets.elastic_arm import gauges, provenance
from flexik.datasets.elastic_arm.learning import KINDS, learning_table, read_learning_data
from flexik.datasets.elastic_arm.readings import (
    FIELDS,
    HELD_OUT,
    SELECTION,
    TRAINING,
    columns_of,
    divide,
    gauges_of,
    noise_generator,
    poses,
)
from flexik.datasets.tables import write_table
from flexik.errors import DataError
from flexik.kinematics.elastic_arm import flexible_forward, forward
from flexik.multibody.elastic_arm.model import Equilibria, equilibria
from flexik.parameters import overlay, read_yaml, validate

GAUGES = gauges_of(ARM)


@pytest.fixture(scope="module")
def few():
    angles = np.radians([[0.0, 0.0], [10.0, -35.0], [30.0, 60.0], [5.0, 5.0]])
    payload = np.array([3.0, 0.0, 1.0, 2.0])
    return angles, payload, equilibria(MODEL, angles, payload)


def read(found, generator=None, settings=GAUGES):
    return gauges.read(settings, *found[1:], generator)


def test_the_readings_are_the_560_of_the_paper():
    angles, payload = poses(ARM.readings)
    assert angles.shape == (560, 2) and payload.shape == (560,)
    assert len(np.unique(np.column_stack([angles, payload]), axis=0)) == 560
    assert np.degrees([angles.min(axis=0), angles.max(axis=0)]) == pytest.approx(
        np.array([[0.0, -35.0], [30.0, 60.0]])
    )
    assert sorted(set(payload)) == [0.0, 1.0, 2.0, 3.0]
    # theta_2 runs first
    assert np.degrees(angles[1] - angles[0]) == pytest.approx([0.0, 5.0])


def test_readings_are_divided_by_seed_into_disjoint_parts():
    part = divide(560, 0.15, 0.15, 1)
    assert {name: int((part == name).sum()) for name in (TRAINING, SELECTION, HELD_OUT)} == {
        TRAINING: 392,
        SELECTION: 84,
        HELD_OUT: 84,
    }
    assert np.array_equal(part, divide(560, 0.15, 0.15, 1))
    assert not np.array_equal(part, divide(560, 0.15, 0.15, 2))


def test_voltages_are_those_of_the_published_lines():
    """Equations 48 to 53 forwards, by hand."""
    deformation = np.array([[-0.005, 0.0, 0.0, 0.002, 0.0, 0.0]])
    shown = gauges.read(GAUGES, deformation, np.array([[-0.002, 0.001]]), np.zeros((1, 2)), None)
    expected = [
        (-0.005 - 8e-5) / 0.0026,
        (-0.005 - 3e-5) / 0.0010,
        (-0.002 + 2e-5) / 0.0008,
        (0.002 - 6e-5) / 0.0016,
        (0.002 - 3e-5) / 0.0022,
        (0.001 + 3e-5) / 0.0022,
    ]
    assert shown.voltages == pytest.approx(np.array([expected]), rel=1e-12)


def test_gauges_without_noise_tell_deflections_exactly(few):
    *_, found = few
    shown = read(found)
    assert shown.deformation[:, [0, 3]] == pytest.approx(found.deformation[:, [0, 3]], abs=1e-15)
    # equation 47
    tangent = (found.deformation[:, 0] - found.station_deflection[:, 0]) / (0.57 - 0.31)
    assert np.tan(shown.deformation[:, 2]) == pytest.approx(tangent, rel=1e-12)
    # equation 54
    assert shown.deformation[:, 4] == pytest.approx(0.62 * found.axial_strain[:, 1], rel=1e-12)


def test_a_chord_turns_less_than_the_tip_it_ends_at(few):
    *_, found = few
    chord, slope = read(found).deformation[:, [2, 5]], found.deformation[:, [2, 5]]
    assert (np.abs(chord) < np.abs(slope)).all()
    assert (np.abs(chord) > 0.75 * np.abs(slope)).all()


def test_noise_and_resolution_are_those_of_params(few):
    *_, found = few
    many = Equilibria(*(np.repeat(values, 2000, axis=0) for values in found))
    exact = read(many)
    fine = replace(GAUGES, resolution=0.0, strain_resolution=0.0)
    noisy = read(many, np.random.default_rng(0), fine)
    assert np.std(noisy.voltages - exact.voltages) == pytest.approx(GAUGES.noise, rel=0.02)
    assert np.std(noisy.strains - exact.strains) == pytest.approx(GAUGES.strain_noise, rel=0.02)
    stepped = read(many, np.random.default_rng(0)).voltages / GAUGES.resolution
    assert stepped == pytest.approx(np.round(stepped), abs=1e-9)
    assert np.abs(stepped * GAUGES.resolution - noisy.voltages).max() <= 0.51 * GAUGES.resolution


def test_uncertainty_of_the_deformation_is_that_of_many_noisy_readings(few):
    """So both gauges of a tip count, by the inverse squares of their slopes."""
    *_, found = few
    many = Equilibria(*(np.repeat(values, 4000, axis=0) for values in found))
    # steps that the noise spreads over
    settings = replace(GAUGES, resolution=1e-3, strain_resolution=1e-7)
    apart = read(many, np.random.default_rng(1), settings).deformation - read(many).deformation
    assert np.std(apart, axis=0) == pytest.approx(gauges.uncertainty(settings), rel=0.03)
    volt = np.hypot(2e-3, 1e-3 / np.sqrt(12))
    least = volt / np.sqrt(0.0026**-2 + 0.0010**-2)
    assert gauges.uncertainty(settings)[0] == pytest.approx(least)
    assert least < volt * 0.0010 < volt * np.hypot(0.0026, 0.0010) / 2


def test_voltages_beyond_the_range_are_clipped_and_counted(few):
    *_, found = few
    exact = read(found).voltages
    assert gauges.n_clipped(GAUGES, exact) == 0
    narrow = replace(GAUGES, voltage_range=(-2.0, 2.0))
    shown = read(found, np.random.default_rng(0), narrow).voltages
    assert shown.min() == -2.0
    assert gauges.n_clipped(narrow, exact) == int((np.abs(exact) >= 2.0).any(axis=1).sum()) > 0


def test_noise_in_the_voltages_alone_leaves_the_strains_exact(few):
    *_, found = few
    settings = gauges_of(ARM, gauges.NOISY_VOLTAGES)
    shown = read(found, noise_generator(ARM, gauges.NOISY_VOLTAGES, 0), settings)
    assert np.array_equal(shown.strains, found.axial_strain)
    assert not np.allclose(shown.voltages, read(found).voltages, atol=1e-5)
    assert gauges_of(ARM, gauges.NOISY) == GAUGES


def test_noise_is_drawn_for_noisy_readings_alone():
    assert noise_generator(ARM, "noise_free", 0) is None
    assert noise_generator(ARM, None, 0) is None
    draws = [noise_generator(ARM, "noisy", stream).random() for stream in (0, 0, 1)]
    assert draws[0] == draws[1] != draws[2]


@pytest.fixture
def tables(few, tmp_path):
    """Tables of four readings in all three parts."""
    angles, payload, found = few
    part = np.array([TRAINING, SELECTION, HELD_OUT, TRAINING])
    made_with = provenance.readings_checksum(ARM)
    rigid = forward(GEOMETRY, angles)
    columns = columns_of([angles, payload, part, rigid, *found], FIELDS)
    write_table(tmp_path / "readings.parquet", columns, FIELDS, made_with)
    for name in gauges.SHOWN:
        shown = read(found, noise_generator(ARM, name, 0))
        tip = flexible_forward(GEOMETRY, angles, shown.deformation)
        write_table(
            tmp_path / f"gauges_{name}.parquet",
            columns_of([*shown, tip], gauges.FIELDS),
            gauges.FIELDS,
            made_with,
        )
    return tmp_path


def test_networks_never_see_held_out_readings(few, tables):
    angles, payload, found = few
    shown = read(found).deformation
    p = flexible_forward(GEOMETRY, angles, shown)
    data = read_learning_data(tables, ARM, "published_network")
    assert np.array_equal(data.inputs, np.hstack([shown, p])[[0, 3]])
    assert np.array_equal(data.outputs, angles[[0, 3]])
    assert np.array_equal(data.selection_outputs, angles[[1]])
    deflection = read_learning_data(tables, ARM, "deflection")
    assert np.array_equal(deflection.inputs, np.column_stack([angles, payload])[[0, 3]])
    sag = found.tip - forward(GEOMETRY, angles)
    assert np.array_equal(deflection.outputs, sag[[0, 3]])
    inverse = read_learning_data(tables, ARM, "inverse")
    assert inverse.selection_inputs.tolist() == [[*found.tip[1], 0.0, -1.0]]
    without = read_learning_data(tables, ARM, "published_network_without_dx")
    assert np.array_equal(without.inputs, np.delete(data.inputs, [1, 4], axis=1))
    noisy = read_learning_data(tables, ARM, "published_network_noisy")
    assert not np.array_equal(noisy.inputs, data.inputs)


def test_inputs_of_the_published_network_are_in_its_order():
    names = [field.name for field in KINDS["gauges"].inputs]
    assert names == ["dy_1", "dx_1", "dphi_1", "dy_2", "dx_2", "dphi_2", "p_x", "p_y"]
    table = learning_table(
        pd.DataFrame({f.name: [0.0] for f in FIELDS}),
        pd.DataFrame({f.name: [1.0] for f in gauges.FIELDS}),
        "gauges",
    )
    assert table[names].to_numpy().tolist() == [[1.0] * 8]  # of the gauges, not of the model


def test_tables_of_other_parameters_are_refused(tables):
    changes = {"elastic_arm": {"structure": {"joint_mass": 0.7}}}
    other = validate(overlay(read_yaml(ROOT / "params.yaml"), changes)).elastic_arm
    with pytest.raises(DataError, match="other parameters"):
        read_learning_data(tables, other, "deflection")
    assert provenance.targets_checksum(other) != provenance.targets_checksum(ARM)


def test_a_network_depends_on_its_own_parameters_alone():
    data = read_yaml(ROOT / "params.yaml")
    changes = {"networks": {"one_layer_15": {"n_restarts": 4}}, "workspace": {"seed": 5}}
    other = validate(overlay(data, {"elastic_arm": changes})).elastic_arm
    for name in ARM.all_networks:
        same = provenance.network_checksum(ARM, name) == provenance.network_checksum(other, name)
        assert same == (name != "one_layer_15")
    assert provenance.evaluation_checksum(ARM, "none") != provenance.evaluation_checksum(
        other, "none"
    )
    assert provenance.fit_checksum(ARM) != provenance.fit_checksum(other)
