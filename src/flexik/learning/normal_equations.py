"""J^T J and J^T e of a perceptron in blocks, without ever holding J; and their damped solution.

Source: Rouvinen 1999, equations 55 and 56; Hagan and Menhaj 1994.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs

from flexik.learning.perceptron import Array
from flexik.learning.problem import Problem, chunk_length
from flexik.learning.weights import Weights


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Blocks of J^T J (w, w), and J^T e (w,) of e = output - target.

    The output layer has the same block for each of its q units, and none between two of them.

    Attributes
    ----------
    hidden : (m, m), all hidden layers
    mixed : (q, k, m), weights of one output unit by hidden layers
    output : (k, k), weights of one output unit
    gradient : (m + q k,), J^T e
    mean_squared_error : of e
    """

    hidden: Array
    mixed: Array
    output: Array
    gradient: Array
    mean_squared_error: float

    def is_finite(self) -> bool:
        """Whether no element overflowed."""
        blocks = (self.hidden, self.mixed, self.output, self.gradient)
        return all(bool(np.isfinite(block).all()) for block in blocks)

    def scale(self, floor: float) -> tuple[Array, Array]:
        """Marquardt's scaling: diagonals (m,) and (k,) of the hidden and the output block.

        At least `floor` times the largest element of each, so that no weight goes undamped.
        """
        blocks = self.hidden.diagonal(), self.output.diagonal()
        hidden, output = (np.maximum(block, floor * block.max()) for block in blocks)
        return hidden, output

    def factor(self, mu: float, scale: tuple[Array, Array] | None = None) -> "DampedFactor | None":
        """Cholesky factor of J^T J + mu D, or None when it is singular in float64.

        The output block is eliminated first, which leaves the Schur complement of size m.

        Parameters
        ----------
        scale : diagonals (m,) and (k,) of D for the hidden and each output block, else D = I
        """
        q, k, m = self.mixed.shape
        d_hidden, d_output = (1.0, 1.0) if scale is None else scale
        output = cholesky(self.output, mu * d_output)
        if output is None:
            return None
        columns = self.mixed.transpose(1, 0, 2).reshape(k, q * m)
        coupling = dtrtrs(output, columns, lower=1)[0]
        coupling = coupling.reshape(k, q, m).transpose(1, 0, 2).reshape(q * k, m)
        hidden = cholesky(self.hidden - coupling.T @ coupling, mu * d_hidden)
        return None if hidden is None else DampedFactor(output, coupling, hidden)


@dataclass(frozen=True, eq=False)
class DampedFactor:
    """Block Cholesky factor of J^T J + mu D."""

    output: Array
    coupling: Array
    hidden: Array

    def solve(self, vector: Array) -> Array:
        """(J^T J + mu D)^-1 vector, both (w,)."""
        k, m = len(self.output), len(self.hidden)
        right = vector[m:].reshape(-1, k).T
        reduced = dtrtrs(self.output, right, lower=1)[0]
        remaining = vector[:m] - reduced.T.ravel() @ self.coupling
        hidden = dpotrs(self.hidden, remaining, lower=1)[0]
        reduced = reduced - (self.coupling @ hidden).reshape(-1, k).T
        output = dtrtrs(self.output, reduced, lower=1, trans=1)[0]
        return np.concatenate([hidden, output.T.ravel()])


def normal_equations(weights: Weights, problem: Problem) -> NormalEquations:
    """Blocks at `weights`; inf or nan where they overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        if len(weights) == 2:
            return _one_hidden_layer(weights, problem)
        return _any_layers(weights, problem)


def _one_hidden_layer(weights: Weights, problem: Problem) -> NormalEquations:
    # All outputs share the rows "slope times input"; one Gram product of [slope x input and bias;
    # hidden outputs and 1; errors] holds every block, and the output weights only scale it.
    (h, n_columns), q = weights[0].shape, len(weights[1])
    m, k = h * n_columns, h + 1
    rows = np.empty((m + k + q, chunk_length(problem.targets.shape[1])))
    # a view: first the contiguous buffer is cut into (h, p + 1, c), then to the chunk
    products = rows[:m].reshape(h, n_columns, -1)
    gram = np.zeros((m + k + q, m + k + q))
    for chunk in problem.chunks(weights):
        c = chunk.inputs.shape[1]
        np.multiply(chunk.slopes[0][:, None, :], chunk.inputs, out=products[:, :, :c])
        rows[m : m + k, :c] = chunk.layers[1]
        rows[m + k :, :c] = chunk.errors(weights)
        gram += rows[:, :c] @ rows[:, :c].T
    coupling = np.repeat(weights[1][:, :-1], n_columns, axis=1)
    hidden = gram[:m, :m] * (coupling.T @ coupling)
    mixed = gram[m : m + k, :m] * coupling[:, None, :]
    by_hidden = np.sum(gram[m + k :, :m] * coupling, axis=0)
    gradient = np.concatenate([by_hidden, gram[m + k :, m : m + k].ravel()])
    error = float(np.trace(gram[m + k :, m + k :])) / problem.targets.size
    return NormalEquations(hidden, mixed, gram[m : m + k, m : m + k].copy(), gradient, error)


def _any_layers(weights: Weights, problem: Problem) -> NormalEquations:
    m, k, q = sum(w.size for w in weights[:-1]), weights[-1].shape[1], len(weights[-1])
    rows = np.empty((m + k + 1, chunk_length(problem.targets.shape[1])))
    grams = np.zeros((q, m + k + 1, m + k + 1))
    for chunk in problem.chunks(weights):
        block, errors = rows[:, : chunk.inputs.shape[1]], chunk.errors(weights)
        layers, slopes = chunk.layers, chunk.slopes
        block[m : m + k] = layers[-1]
        for unit in range(q):
            # derivative of this output by the net inputs of a layer, from the last layer down
            derivative, end = weights[-1][unit, :-1, None] * slopes[-1], m
            for layer in range(len(weights) - 2, -1, -1):
                start = end - weights[layer].size
                products = derivative[:, None, :] * layers[layer][None, :, :]
                block[start:end] = products.reshape(end - start, -1)
                if layer > 0:
                    derivative = (weights[layer][:, :-1].T @ derivative) * slopes[layer - 1]
                end = start
            block[-1] = errors[unit]
            grams[unit] += block @ block.T
    gradient = np.concatenate([grams[:, -1, :m].sum(axis=0), grams[:, -1, m:-1].ravel()])
    error = float(grams[:, -1, -1].sum()) / problem.targets.size
    hidden, mixed = grams[:, :m, :m].sum(axis=0), grams[:, m:-1, :m].copy()
    return NormalEquations(hidden, mixed, grams[0, m:-1, m:-1].copy(), gradient, error)


def cholesky(matrix: Array, damping: Array | float) -> Array | None:
    """Lower factor of the symmetric `matrix` + diag(`damping`), or None when there is none.

    LAPACK is called without SciPy's checks, which cost as much as the work on small matrices.
    """
    damped = np.array(matrix, order="F")
    np.einsum("ii->i", damped)[:] += damping
    factor, info = dpotrf(damped, lower=1, clean=0, overwrite_a=1)
    # nan passes through some builds of LAPACK
    return factor if info == 0 and np.isfinite(factor[-1, -1]) else None
