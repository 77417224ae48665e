"""Small training problems, and the same network written independently for automatic derivatives."""

import functools
import pickle

import numpy as np
import torch

from flexik.datasets.parts import Work
from flexik.learning.problem import Problem, problem
from flexik.learning.weights import Weights, flatten, initial_weights

FUNCTIONS = {"tanh": torch.tanh, "logistic": torch.sigmoid}

# inputs, hidden units, outputs
ARCHITECTURES = [(3, (4,), 2), (1, (1,), 1), (2, (5,), 3), (3, (4, 3), 2), (2, (3, 1, 4), 3)]


def some_problem(
    n: int = 40,
    p: int = 3,
    hidden: tuple[int, ...] = (4,),
    q: int = 2,
    activation: str = "tanh",
    seed: int = 0,
    selection: bool = False,
) -> tuple[Weights, Problem]:
    """Smooth data with a little noise, and Nguyen-Widrow weights."""
    generator = np.random.default_rng(seed)
    mixing = generator.normal(size=(p, q))

    def data(n: int) -> tuple[np.ndarray, np.ndarray]:
        inputs = generator.uniform(-1.0, 1.0, (n, p))
        noise = 0.02 * generator.normal(size=(n, q))
        return inputs, np.sin(2.0 * inputs @ mixing) + noise

    start = initial_weights(p, hidden, q, activation, np.random.default_rng(seed))
    # the training data come first, the selection data do not change them
    inputs, targets = data(n)
    return start, problem(activation, inputs, targets, data(n) if selection else None)


def outputs(vector: torch.Tensor, like: Weights, activation: str, inputs: np.ndarray):
    """Outputs (n * q,) of a network with the flat weights `vector`."""
    values = torch.from_numpy(inputs)
    parts = torch.split(vector, [matrix.size for matrix in like])
    for k, (part, matrix) in enumerate(zip(parts, like, strict=True)):
        weights = part.reshape(matrix.shape)
        values = values @ weights[:, :-1].T + weights[:, -1]
        if k < len(like) - 1:
            values = FUNCTIONS[activation](values)
    return values.reshape(-1)


def errors_function(start: Weights, problem: Problem):
    """Function of the flat weights: errors (n * q,), sample by sample."""
    inputs = np.ascontiguousarray(problem.inputs[:-1].T)
    targets = torch.from_numpy(problem.targets.T.ravel())
    network = functools.partial(outputs, like=start, activation=problem.activation, inputs=inputs)
    return lambda vector: network(vector) - targets


def dense(weights: Weights, problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """J (n * q, w) and e (n * q,) by automatic differentiation."""
    function, vector = errors_function(weights, problem), torch.from_numpy(flatten(weights))
    return torch.autograd.functional.jacobian(function, vector).numpy(), function(vector).numpy()


def taught(
    activation: str, seed: int, n: int = 200, hidden: tuple[int, ...] = (3,), noise: float = 0.0
) -> tuple[Weights, Problem]:
    """Data made by a network of two inputs and outputs, and that network."""
    generator = np.random.default_rng(seed)
    teacher = initial_weights(2, hidden, 2, activation, generator)
    inputs = generator.uniform(-1.0, 1.0, (n, 2))
    targets = outputs(torch.from_numpy(flatten(teacher)), teacher, activation, inputs).numpy()
    targets = targets.reshape(n, 2) + noise * generator.normal(size=(n, 2))
    return teacher, problem(activation, inputs, targets)


def written(work: Work, folder):
    """Files of `work` by extension; its function and results are pickled as between processes."""
    there = pickle.loads(pickle.dumps(work.function))
    results = [pickle.loads(pickle.dumps(there(item))) for item in work.items]
    files = {}
    for extension, write in work.finish(results).items():
        files[extension] = folder / f"name{extension}"
        write(files[extension])
    return files
