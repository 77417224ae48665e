"""Method `predicted`: what a network that learnt the answer says, without any search."""

from dataclasses import dataclass

import numpy as np

from flexik.kinematics.status import limit_status
from flexik.learning.perceptron import Network
from flexik.positioning.method import Answer, Array


@dataclass(frozen=True, eq=False)
class Predicted:
    """Outputs of a network at the first columns of the query, as many as it has inputs.

    lower, upper : limits (k,) of the answers; a row beyond them is ACTUATOR_LIMIT.
    """

    network: Network
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __call__(self, query: Array, current: Array) -> Answer:
        """See `flexik.positioning.method.Method`."""
        values = self.network.predict(np.ascontiguousarray(query[:, : len(self.network.inputs)]))
        return Answer(values, limit_status(values, self.lower, self.upper))
