"""The torch module that serves where params.yaml names none: layers of units, one activation."""

import torch
from torch import nn


class Layers(nn.Sequential):
    """Fully connected layers, the last one linear.

    n_hidden : units of each hidden layer
    activation : a class of torch.nn: Tanh, SiLU, GELU, Softplus
    """

    def __init__(
        self, n_inputs: int, n_outputs: int, n_hidden: list[int], activation: str = "SiLU"
    ) -> None:
        kind = getattr(nn, activation, None)
        if not (isinstance(kind, type) and issubclass(kind, nn.Module)):
            raise ValueError(f"activation {activation!r} is no class of torch.nn")
        layers: list[nn.Module] = []
        for n_units in n_hidden:
            layers += [nn.Linear(n_inputs, n_units, dtype=torch.float64), kind()]
            n_inputs = n_units
        super().__init__(*layers, nn.Linear(n_inputs, n_outputs, dtype=torch.float64))
