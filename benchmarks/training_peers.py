"""Other packages that can train the same perceptron: one function each, of a case and a watch.

All use float64 and one thread, begin with the weights of the case and tell the watch their root
mean square error. What is told to none of them keeps the default of its package. Packages are
imported here by name, for none of them but SciPy has to be installed.
"""

import machine  # noqa: F401

# isort: split
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any, Literal

import numpy as np
from scipy.optimize import least_squares
from training_data import ACTIVATION, SEED, Array, Case, Watch

from flexik.learning.weights import Weights, flatten, forward, unflatten

# MKL's kernels that are the same everywhere are slow: torch, a peer, has those it would choose.
# Our trainers in the races do without MKL
os.environ.pop("MKL_CBWR", None)

# large enough that no package stops for its own count
ENDLESS = 10**9
ADAM_BATCH, ADAM_RATE = 128, 3e-3


def residuals_and_jacobian(case: Case) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Residuals (n q,) and their analytic Jacobian (n q, w) as functions of the weights (w,)."""
    inputs, targets = case.problem.inputs, case.problem.targets
    (q, n), (h, columns) = targets.shape, case.start[0].shape

    def residuals(vector: Array) -> Array:
        weights = unflatten(vector, case.start)
        outputs = weights[-1] @ forward(weights, ACTIVATION, inputs)[-1]
        return (outputs - targets).ravel()

    def jacobian(vector: Array) -> Array:
        weights = unflatten(vector, case.start)
        layers = forward(weights, ACTIVATION, inputs)
        hidden = layers[1][:-1].T
        products = ((1.0 - hidden * hidden)[:, :, None] * inputs.T[:, None, :]).reshape(n, -1)
        full = np.zeros((q, n, len(vector)))
        for k in range(q):
            np.multiply(products, np.repeat(weights[1][k, :-1], columns), full[k, :, : h * columns])
            first = h * columns + k * (h + 1)
            full[k, :, first : first + h + 1] = layers[1].T
        return full.reshape(q * n, -1)

    return residuals, jacobian


def scipy_least_squares(case: Case, watch: Watch, method: Literal["trf", "lm"]) -> None:
    """scipy.optimize.least_squares with the analytic Jacobian; its own stopping is off."""
    residuals, jacobian = residuals_and_jacobian(case)

    def noted(vector: Array) -> Array:
        errors = residuals(vector)
        watch.note(float(np.sqrt(np.mean(errors**2))))
        return errors

    watch.start()
    least_squares(
        noted,
        flatten(case.start),
        jacobian,
        method=method,
        max_nfev=10**6,
        ftol=1e-15,
        xtol=1e-15,
        gtol=1e-15,
    )


def torch_model(case: Case) -> tuple[Any, Any, Any]:
    """Network with the weights of the case, inputs and targets, all of torch in float64."""
    torch = import_module("torch")
    torch.set_num_threads(1)
    torch.set_default_dtype(torch.float64)
    (h, columns), q = case.start[0].shape, len(case.start[1])
    layers = torch.nn.Linear(columns - 1, h), torch.nn.Tanh(), torch.nn.Linear(h, q)
    with torch.no_grad():
        for layer, matrix in zip(layers[::2], case.start, strict=True):
            layer.weight.copy_(torch.tensor(matrix[:, :-1]))
            layer.bias.copy_(torch.tensor(matrix[:, -1]))
    return torch.nn.Sequential(*layers), torch.tensor(case.inputs), torch.tensor(case.targets)


def torch_weights(model: Any) -> Weights:
    """Weights of `torch_model`."""
    first, last = (
        np.column_stack([layer.weight.detach().numpy(), layer.bias.detach().numpy()])
        for layer in (model[0], model[2])
    )
    return first, last


def torch_levenberg_marquardt(case: Case, watch: Watch) -> None:
    """torch-levenberg-marquardt, all samples in every step."""
    training = import_module("torch_levenberg_marquardt.training")
    model, inputs, targets = torch_model(case)
    module = training.LevenbergMarquardtModule(model)
    watch.start()
    watch.note_of(case, torch_weights(model))
    stop = False
    while not stop:
        _, _, stop, _ = module.training_step(inputs, targets)
        watch.note_of(case, torch_weights(model))


def torch_lbfgs(case: Case, watch: Watch) -> None:
    """torch.optim.LBFGS with the strong Wolfe line search."""
    torch = import_module("torch")
    model, inputs, targets = torch_model(case)
    options = {"max_iter": 1000, "tolerance_grad": 0.0, "tolerance_change": 0.0}
    optimizer = torch.optim.LBFGS(model.parameters(), line_search_fn="strong_wolfe", **options)

    def closure() -> Any:
        optimizer.zero_grad()
        loss = torch.nn.functional.mse_loss(model(inputs), targets)
        loss.backward()
        watch.note(float(loss.detach().sqrt()))
        return loss

    watch.start()
    while True:
        optimizer.step(closure)


def torch_adam(case: Case, watch: Watch) -> None:
    """torch.optim.Adam on shuffled batches; the error is that after each pass over the data."""
    torch = import_module("torch")
    model, inputs, targets = torch_model(case)
    optimizer = torch.optim.Adam(model.parameters(), lr=ADAM_RATE)
    generator = torch.Generator().manual_seed(SEED)
    watch.start()
    while True:
        watch.note_of(case, torch_weights(model))
        for batch in torch.randperm(len(inputs), generator=generator).split(ADAM_BATCH):
            optimizer.zero_grad()
            torch.nn.functional.mse_loss(model(inputs[batch]), targets[batch]).backward()
            optimizer.step()


def optimistix(case: Case, watch: Watch) -> None:
    """optimistix.LevenbergMarquardt, step by step; compiling is not counted."""
    jax = import_module("jax")
    jax.config.update("jax_enable_x64", True)
    eqx, optx = import_module("equinox"), import_module("optimistix")
    jnp = jax.numpy
    inputs, targets = jnp.asarray(case.inputs), jnp.asarray(case.targets)
    solver = optx.LevenbergMarquardt(rtol=1e-15, atol=1e-15)

    def residuals(weights: Any, _: Any) -> Any:
        first, last = weights
        hidden = jnp.tanh(inputs @ first[:, :-1].T + first[:, -1])
        return (hidden @ last[:, :-1].T + last[:, -1] - targets).ravel(), None

    shared: dict[str, Any] = {"fn": residuals, "args": None, "options": {}, "tags": frozenset()}
    weights = tuple(jnp.asarray(matrix) for matrix in case.start)
    shape = jax.eval_shape(lambda: residuals(weights, None))
    state = solver.init(y=weights, f_struct=shape[0], aux_struct=None, **shared)
    step = eqx.filter_jit(eqx.Partial(solver.step, **shared))
    jax.block_until_ready(step(y=weights, state=state)[0])  # compiles, the result is not used
    watch.start()
    watch.note_of(case, case.start)
    while True:
        weights, state, _ = step(y=weights, state=state)
        jax.block_until_ready(weights)
        first, last = (np.asarray(matrix) for matrix in weights)
        watch.note_of(case, (first, last))


def scikit_learn(case: Case, watch: Watch) -> None:
    """MLPRegressor with solver lbfgs and no penalty; started anew whenever it ends by itself.

    It has no argument for the start: the weights are put in as those of an earlier fit.
    """
    neural = import_module("sklearn.neural_network")

    class Regressor(neural.MLPRegressor):  # type: ignore[name-defined]
        watched = False

        def _loss_grad_lbfgs(self, *arguments: Any) -> Any:
            loss, gradient = super()._loss_grad_lbfgs(*arguments)
            if self.watched:
                watch.note(float(np.sqrt(2.0 * loss)))  # the loss is half the mean square
            return loss, gradient

    size = (len(case.start[0]),)
    options = {"activation": ACTIVATION, "solver": "lbfgs", "alpha": 0.0, "tol": 0.0}
    model = Regressor(hidden_layer_sizes=size, max_iter=1, warm_start=True, **options)
    model.fit(case.inputs, case.targets)  # makes the attributes that a start needs
    model.max_iter = model.max_fun = ENDLESS
    model.coefs_ = [matrix[:, :-1].T.copy() for matrix in case.start]
    model.intercepts_ = [matrix[:, -1].copy() for matrix in case.start]
    model.watched = True
    watch.start()
    before = np.inf
    while watch.best < before or np.isinf(before):
        before = watch.best
        model.fit(case.inputs, case.targets)


@dataclass(frozen=True)
class Peer:
    """A name for people, the package to be installed, and the function."""

    label: str
    package: str
    run: Callable[[Case, Watch], None]


PEERS = {
    "scipy_trf": Peer(
        "scipy least_squares trf", "scipy", partial(scipy_least_squares, method="trf")
    ),
    "scipy_lm": Peer("scipy least_squares lm", "scipy", partial(scipy_least_squares, method="lm")),
    "torch_lm": Peer(
        "torch-levenberg-marquardt", "torch-levenberg-marquardt", torch_levenberg_marquardt
    ),
    "optimistix": Peer("optimistix LevenbergMarquardt", "optimistix", optimistix),
    "scikit_learn": Peer("scikit-learn MLPRegressor (lbfgs)", "scikit-learn", scikit_learn),
    "torch_lbfgs": Peer("torch L-BFGS", "torch", torch_lbfgs),
    "torch_adam": Peer("torch Adam", "torch", torch_adam),
}


@contextmanager
def silent() -> Iterator[None]:
    """Keep the packages' own warnings (convergence, deprecation) from the table."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
