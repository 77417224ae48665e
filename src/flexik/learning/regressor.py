"""Regressors of scikit-learn in place of a network, by name and options; stored without pickle.

`{name: KernelRidge, kernel: rbf, gamma: 0.3}` is `KernelRidge(kernel="rbf", gamma=0.3)`; an option
that has a name itself is made likewise, as are the steps of a Pipeline. scikit-learn and skops are
imported only where a regressor is made or read.
"""

import importlib
import inspect
import io
import json
import warnings
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from flexik.errors import DataError, FlexikError, TrainingError
from flexik.learning.examples import Examples
from flexik.learning.perceptron import Array, Normalisation

# Where scikit-learn keeps what a regressor is made of
ROOMS = (
    *("linear_model", "kernel_ridge", "gaussian_process", "gaussian_process.kernels", "svm"),
    *("ensemble", "neural_network", "neighbors", "tree", "preprocessing", "kernel_approximation"),
)
# Types a file may hold beside those that skops trusts: no others are loaded
TRUSTED = [
    *(
        f"sklearn.gaussian_process.kernels.{name}"
        for name in (
            *("RBF", "Matern", "RationalQuadratic", "ExpSineSquared", "DotProduct", "Sum"),
            *("ConstantKernel", "WhiteKernel", "Product", "Exponentiation"),
        )
    ),
    "sklearn.tree._tree.Tree",
    "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
    "sklearn._loss.link.IdentityLink",
    "sklearn._loss.link.Interval",
    "sklearn._loss.loss.HalfSquaredError",
    "sklearn._loss._loss.CyHalfSquaredError",
    "sklearn.neural_network._stochastic_optimizers.AdamOptimizer",
    "sklearn.neural_network._stochastic_optimizers.SGDOptimizer",
    "sklearn.metrics._dist_metrics.EuclideanDistance64",
    "sklearn.neighbors._kd_tree.KDTree64",
    "sklearn.neighbors._ball_tree.BallTree64",
]


@dataclass(frozen=True, eq=False)
class Regressor:
    """A fitted estimator between normalised inputs (p) and outputs (q)."""

    estimator: Any
    input_normalisation: Normalisation
    output_normalisation: Normalisation

    def predict(self, values: Array) -> Array:
        """Return the outputs (n, q) at inputs `values` (n, p), both in SI units.

        Raises FlexikError when `values` has another shape.
        """
        p, q = (len(each.minimum) for each in (self.input_normalisation, self.output_normalisation))
        if values.ndim != 2 or values.shape[1] != p:
            raise FlexikError(f"values have shape {values.shape}, expected (n, {p})")
        if not len(values):  # which scikit-learn refuses
            return np.empty((0, q))
        with threadpool_limits(1):
            unit = self.estimator.predict(self.input_normalisation.to_unit(values))
        return self.output_normalisation.from_unit(unit.reshape(len(values), q))


def estimator(given: Any, seed: int | None = None) -> Any:
    """What `given` of params.yaml stands for; TrainingError if scikit-learn has nothing like it.

    seed : of what draws at random and is told none
    """
    if isinstance(given, list):
        return [estimator(each) for each in given]
    if not (isinstance(given, Mapping) and "name" in given):
        return given
    options = {name: estimator(value) for name, value in given.items() if name != "name"}
    try:
        if given["name"] == "Pipeline":
            made = importlib.import_module("sklearn.pipeline").make_pipeline(*options["steps"])
        else:
            made = _class(given["name"])(**options)
    except (TypeError, KeyError) as error:
        raise TrainingError(f"{given['name']}: {error}") from None
    if seed is not None:
        drawn = {k: v for k, v in made.get_params().items() if k.endswith("random_state")}
        made.set_params(**{k: seed for k, v in drawn.items() if v is None})
    return made


def _class(name: str) -> Any:
    for room in ROOMS:
        found = getattr(importlib.import_module(f"sklearn.{room}"), name, None)
        if inspect.isclass(found):
            return found
    raise TrainingError(f"scikit-learn has no {name!r} in {', '.join(ROOMS)}")


def fit(given: Mapping[str, Any], seed: int, examples: Examples) -> Regressor:
    """Regressor `given` that has learnt `examples`; raises TrainingError if it cannot."""
    made = estimator(given, seed)
    inputs, outputs = examples.unit()
    try:
        if not importlib.import_module("sklearn.utils").get_tags(made).target_tags.multi_output:
            made = importlib.import_module("sklearn.multioutput").MultiOutputRegressor(made)
        with threadpool_limits(1), warnings.catch_warnings():
            # training ends where the options say; the selection error tells what it is worth
            warnings.simplefilter("ignore")
            made.fit(inputs, outputs)
    except (TypeError, ValueError, AttributeError, MemoryError) as error:
        raise TrainingError(f"{given['name']}: {str(error) or 'out of memory'}") from None
    last = made.steps[-1][1] if hasattr(made, "steps") else made
    # a Gaussian process keeps a square matrix for its standard deviation, which nothing asks for
    vars(last).pop("L_", None)
    return Regressor(made, examples.scales.inputs, examples.scales.outputs)


def stored(regressor: Regressor) -> bytes:
    """The bytes of a file: the same ones for the same regressor.

    Raises TrainingError when it holds a type that `load` would not trust.
    """
    from skops import io as skops

    scales = regressor.input_normalisation, regressor.output_normalisation
    held = {"estimator": regressor.estimator, "scales": [vars(scale) for scale in scales]}
    data = skops.dumps(held)
    if other := sorted(set(skops.get_untrusted_types(data=data)) - set(TRUSTED)):
        raise TrainingError(
            f"{type(regressor.estimator).__name__} holds {other[0]}, which is none of the types "
            "that flexik.learning.regressor trusts in a file"
        )
    return _lasting(data)


def _lasting(data: bytes) -> bytes:
    """The archive of skops without addresses in memory and times, which differ from run to run."""
    numbers: dict[str, str] = {}

    def number(address: object) -> str:
        return numbers.setdefault(str(address), str(len(numbers)))

    def renumber(node: Any) -> Any:
        if isinstance(node, list):
            return [renumber(each) for each in node]
        if not isinstance(node, dict):
            return node
        node = {name: renumber(value) for name, value in node.items()}
        if "__id__" in node:
            node["__id__"] = int(number(node["__id__"]))
        if isinstance(node.get("file"), str):
            stem, _, extension = node["file"].partition(".")
            node["file"] = f"{number(stem)}.{extension}"
        return node

    written = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as given, zipfile.ZipFile(written, "w") as archive:
        schema = json.dumps(renumber(json.loads(given.read("schema.json"))))
        files = {"schema.json": schema.encode()}
        for name in given.namelist():
            stem, _, extension = name.partition(".")
            if stem in numbers:
                files[f"{numbers[stem]}.{extension}"] = given.read(name)
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name), files[name])
    return written.getvalue()


def load_regressor(path: Path | str) -> list[tuple[Regressor, None]]:
    """The regressor of the file `path`, as files of networks are read; it has no record.

    Raises DataError when it is missing, damaged, or holds what is not trusted.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from None
    from skops import io as skops

    try:
        held = skops.loads(data, trusted=TRUSTED)
        scales = [Normalisation(**scale) for scale in held["scales"]]
        return [(Regressor(held["estimator"], *scales), None)]
    except Exception as error:  # whatever damage makes zipfile, json or skops raise
        raise DataError(f"{path}: no regressor ({type(error).__name__}: {error})") from None
