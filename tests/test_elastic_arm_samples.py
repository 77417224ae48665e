"""Readings of the elastic arm, its gauges, and what networks learn from."""

import numpy as np
import pandas as pd
import pytest
from elastic_arm import GEOMETRY, MODEL, SECTION

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.arm import Equilibria, equilibria
from flexik.cases.elastic_arm.parts.gauges import noise_generator
from flexik.cases.elastic_arm.parts.generate import parts
from flexik.cases.elastic_arm.parts.kinds import KINDS, learning_data, learning_table
from flexik.cases.elastic_arm.parts.readings import (
    ANGLES,
    FIELDS,
    HELD_OUT,
    SELECTION,
    TRAINING,
    divide,
    poses,
)
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import make
from flexik.datasets.tables import read_table
from flexik.kinematics.elastic_arm import DEFORMATION, elbow, flexible_forward

MACHINE = SECTION.machine
GAUGES = MACHINE.gauges


@pytest.fixture(scope="module")
def few():
    angles = np.radians([[0.0, 0.0], [10.0, -35.0], [30.0, 60.0], [5.0, 5.0]])
    payload = np.array([3.0, 0.0, 1.0, 2.0])
    return angles, payload, equilibria(MODEL, angles, payload)


def other(**changes):
    return MACHINE.model_copy(update={"instruments": GAUGES.model_copy(update=changes)})


def read(found, generator=None, machine=MACHINE, **options):
    return gauges.read(machine, *found[1:], generator, **options)


def test_the_readings_are_the_560_of_the_paper():
    angles, payload = poses(SECTION.samples)
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
    shown = gauges.read(MACHINE, deformation, np.array([[-0.002, 0.001]]), np.zeros((1, 2)), None)
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
    fine = other(resolution=0.0, strain_resolution=0.0)
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
    settings = other(resolution=1e-3, strain_resolution=1e-7)
    apart = read(many, np.random.default_rng(1), settings).deformation - read(many).deformation
    assert np.std(apart, axis=0) == pytest.approx(gauges.uncertainty(settings), rel=0.03)
    volt = np.hypot(2e-3, 1e-3 / np.sqrt(12))
    least = volt / np.sqrt(0.0026**-2 + 0.0010**-2)
    assert gauges.uncertainty(settings)[0] == pytest.approx(least)
    assert least < volt * 0.0010 < volt * np.hypot(0.0026, 0.0010) / 2


def test_voltages_beyond_the_range_are_clipped_and_counted(few):
    *_, found = few
    exact = read(found).voltages
    assert gauges.n_clipped(MACHINE, exact) == 0
    narrow = other(voltage_range=(-2.0, 2.0))
    shown = read(found, np.random.default_rng(0), narrow).voltages
    assert shown.min() == -2.0
    assert gauges.n_clipped(narrow, exact) == int((np.abs(exact) >= 2.0).any(axis=1).sum()) > 0


def test_noise_in_the_voltages_alone_leaves_the_strains_exact(few):
    *_, found = few
    shown = read(found, noise_generator(gauges.NOISY_VOLTAGES, 3, 0), exact_strains=True)
    assert np.array_equal(shown.strains, found.axial_strain)
    assert not np.allclose(shown.voltages, read(found).voltages, atol=1e-5)


def test_noise_is_drawn_for_noisy_readings_alone():
    assert noise_generator("noise_free", 3, 0) is None
    draws = [noise_generator("noisy", 3, stream).random() for stream in (0, 0, 1)]
    assert draws[0] == draws[1] != draws[2]


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """All samples of a coarse grid and few targets, as the stage makes them."""
    given = SECTION.samples
    axes = {name: getattr(given, name) for name in ("theta_1_degrees", "theta_2_degrees")}
    coarse = {
        name: axis.model_copy(update={"increment": 15.0 if k == 0 else 19.0})
        for k, (name, axis) in enumerate(axes.items())
    }
    drawn = SECTION.conditions["workspace"].model_copy(update={"n_targets": 12})
    update = {"samples": given.model_copy(update=coarse), "conditions": {"workspace": drawn}}
    folder = tmp_path_factory.mktemp("samples")
    make(folder, parts(SECTION.model_copy(update=update)), ParallelSettings(n_workers=1))
    return folder


def test_networks_never_see_held_out_readings(tables):
    readings = read_table(tables / "readings.parquet", FIELDS)
    angles, payload = readings[list(ANGLES)].to_numpy(), readings["payload"].to_numpy()
    tip = readings[["tip_x", "tip_y"]].to_numpy()
    exact, noisy = (
        read_table(tables / f"readings.{shown}.parquet", gauges.FIELDS)
        for shown in ("noise_free", "noisy")
    )
    deformation = exact[list(DEFORMATION)].to_numpy()
    p = flexible_forward(GEOMETRY, angles, deformation)
    expected = {
        "gauges": np.hstack([deformation, p]),
        "gauges_without_dx": np.hstack([deformation[:, [0, 2, 3, 5]], p]),
        "gauges_elbow": np.column_stack([deformation, p, elbow(angles)]),
        "deflection": np.column_stack([angles, payload]),
        "tip": np.column_stack([angles, payload]),
        "coordinates": np.column_stack([tip, payload, elbow(angles)]),
    }
    outputs = {"deflection": tip - GEOMETRY.forward(angles), "tip": tip}
    part = readings["part"]
    assert set(expected) == set(KINDS)
    for kind, inputs in expected.items():
        paths = (tables / "readings.parquet", tables / "readings.noise_free.parquet")
        data = learning_data(kind, *paths)
        for name in (TRAINING, SELECTION, HELD_OUT):
            rows, found = (part == name).to_numpy(), data.of(name)
            assert rows.sum() > 4
            assert np.array_equal(found[0], inputs[rows])
            assert found[1] == pytest.approx(outputs.get(kind, angles)[rows], abs=1e-15)
    assert not np.isclose(noisy[["p_x", "p_y"]], p, atol=1e-9).all()


def test_targets_are_reached_within_the_range_of_the_readings(tables):
    targets = read_table(tables / "workspace.parquet")
    angles = targets[list(ANGLES)].to_numpy()
    tip = equilibria(MODEL, angles, targets["payload"].to_numpy()).tip
    assert tip == pytest.approx(targets[["target_x", "target_y"]].to_numpy(), abs=1e-7)
    low, high = np.radians([[0.0, -35.0], [30.0, 60.0]])
    assert ((angles >= low) & (angles <= high)).all() and len(targets) == 12


def test_gauges_are_noisy_at_the_targets_too(tables):
    exact, noisy, voltages = (
        read_table(tables / f"workspace.{shown}.parquet")[list(DEFORMATION)].to_numpy()
        for shown in gauges.SHOWN
    )
    assert (exact[:, 4] < 0.0).any() and exact.shape == (12, 6)
    uncertain = gauges.uncertainty(MACHINE)
    for shown, strains_are_exact in ((noisy, False), (voltages, True)):
        off = np.abs(shown - exact)
        assert (off[:, [0, 2, 3, 5]] > 0.0).all() and (off < 6 * uncertain).all()
        assert (off[:, [1, 4]] == 0.0).all() == strains_are_exact
    of_readings = read_table(tables / "readings.noisy.parquet")[list(DEFORMATION)].to_numpy()
    exact_there = read_table(tables / "readings.noise_free.parquet")[list(DEFORMATION)].to_numpy()
    # another stream of the same seed
    assert not np.allclose((of_readings - exact_there)[:12, 1], (noisy - exact)[:, 1], atol=1e-9)


def test_inputs_of_the_published_network_are_in_its_order():
    names = list(KINDS["gauges"].inputs)
    assert names == ["dy_1", "dx_1", "dphi_1", "dy_2", "dx_2", "dphi_2", "p_x", "p_y"]
    table = learning_table(
        pd.DataFrame({f.name: [0.0] for f in FIELDS}),
        pd.DataFrame({f.name: [1.0] for f in gauges.FIELDS}),
    )
    assert table[names].to_numpy().tolist() == [[1.0] * 8]  # of the gauges, not of the model
