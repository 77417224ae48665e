"""Show under- and overfitting: deflection networks of several sizes, trained on a thinned grid.

Reads params.yaml: crane.fitting, its trainer under crane.trainers (and crane.geometry,
crane.structure, crane.grid to know which data belong to it); data/crane/calibration.json;
data/crane/grid.parquet.
Writes data/crane/fitting.parquet: the vertical deflection along one line of the grid that no
network was trained on, as the flexible model and each network have it.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters, stage
from flexik.datasets.crane.grid import FIELDS, INPUTS, deflection, kept
from flexik.datasets.crane.learning import FITTING_FIELDS, KINDS, on_line
from flexik.datasets.crane.provenance import fitting_checksum, grid_checksum
from flexik.datasets.tables import read_table, write_table
from flexik.errors import ParameterError, TrainingError
from flexik.learning.perceptron import Network, quantities
from flexik.learning.training import Architecture, train, trainer_settings
from flexik.kinematics.crane import forward
from flexik.multibody.crane.assembly import flexible_crane, read_spring_stiffness
from flexik.multibody.crane.model import tips
from flexik.parameters import load_parameters

FOLDER = Path("data/crane")
N_POINTS = 101


def main() -> None:
    """Run the stage."""
    crane = load_parameters().crane
    fitting = crane.fitting
    stiffness = read_spring_stiffness(FOLDER / "calibration.json")
    made_with = grid_checksum(crane, stiffness)
    grid = kept(read_table(FOLDER / "grid.parquet", FIELDS, made_with))
    left_out = on_line(grid, fitting.jib, fitting.extension, fitting.payload)
    if left_out.sum() < 2:
        raise ParameterError(
            "crane.fitting: jib, extension and payload are no values of crane.grid that leave a "
            "line of poses"
        )
    others = grid[~on_line(grid, fitting.jib, fitting.extension)]
    if len(others) < fitting.n_samples:
        raise ParameterError(f"crane.fitting.n_samples: the grid has {len(others)} to choose from")
    rows = np.random.default_rng(fitting.seed).choice(len(others), fitting.n_samples, False)
    samples, line = others.iloc[rows], grid[left_out]
    model = flexible_crane(crane, stiffness)
    lift = np.linspace(line["lift_stroke"].min(), line["lift_stroke"].max(), N_POINTS)
    strokes = np.column_stack([lift, np.full((N_POINTS, 2), [fitting.jib, fitting.extension])])
    payload = np.full(N_POINTS, fitting.payload)
    truth = (tips(model, strokes, payload) - forward(model.geometry, strokes))[:, 1]
    tables = []
    for n_hidden in fitting.n_hidden:
        network = trained(crane, n_hidden, samples)
        found = network.predict(np.column_stack([strokes, payload]))[:, 1]
        missed = network.predict(line[list(INPUTS)].to_numpy())[:, 1] - deflection(line)[:, 1]
        columns = (n_hidden, lift, truth, found)
        names = (field.name for field in FITTING_FIELDS)
        tables.append(pd.DataFrame(dict(zip(names, columns, strict=True))))
        print(
            f"{n_hidden} hidden neurons: largest error on the line left out "
            f"{1e3 * np.abs(missed).max():.1f} mm"
        )
    table = pd.concat(tables)
    write_table(
        FOLDER / "fitting.parquet",
        {field.name: table[field.name].to_numpy() for field in FITTING_FIELDS},
        FITTING_FIELDS,
        fitting_checksum(crane, stiffness),
    )


def trained(crane: parameters.Crane, n_hidden: int, samples: pd.DataFrame) -> Network:
    """Deflection network of `n_hidden` neurons that learnt from `samples`."""
    trainer = crane.trainers[crane.fitting.trainer].model_dump()
    try:
        network, _ = train(
            samples[list(INPUTS)].to_numpy(),
            deflection(samples),
            Architecture(n_hidden, "tanh"),
            trainer_settings(trainer.pop("kind"), trainer),
            crane.fitting.seed,
            quantities(KINDS["deflection"].inputs),
            quantities(KINDS["deflection"].outputs),
        )
    except TrainingError as error:
        raise TrainingError(f"crane.fitting, n_hidden {n_hidden}: {error}") from None
    return network


if __name__ == "__main__":
    stage.run(main)
