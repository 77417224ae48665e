"""Networks as JSON: exact float64, the same bytes for the same networks, readable anywhere.

A file holds one network or several (of all restarts): weights, normalisation, names and units, and
the training record. The formula is that of `flexik.learning.perceptron.Network`.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from flexik import files
from flexik.errors import DataError, FlexikError
from flexik.learning.perceptron import Network, Normalisation, Quantity
from flexik.learning.stopping import StopReason

FORMAT, VERSION = "flexik-networks", 3
Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class TrainingRecord:
    """How a network came to be.

    Attributes
    ----------
    trainer : kind of the trainer
    seed, restart : the initial weights are drawn from the NumPy generator of (seed, restart)
    stop_reason : why the run ended
    errors : mean squared error of the normalised outputs per iteration, the first the initial
        one; empty when the run gave no usable network
    kept : the iteration the network is of; the last one unless the errors rose or the settings
        asked for selection patience
    selection_error : root mean square of the normalised output errors on the selection data, or
        what the judge of the run says; None where there is neither, or it is not finite
    """

    trainer: str
    seed: int
    restart: int
    stop_reason: StopReason
    errors: tuple[float, ...]
    kept: int
    selection_error: float | None

    @property
    def training_error(self) -> float:
        """Root mean square of the normalised output errors; nan without a usable network."""
        return math.sqrt(self.errors[self.kept]) if self.errors else math.nan

    @property
    def rank(self) -> float:
        """Selection error, inf when there is none to compare."""
        return math.inf if self.selection_error is None else self.selection_error


Trained = tuple[Network, TrainingRecord]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Layer(_Section):
    weights: list[list[float]]
    bias: list[float]


class _Extremes(_Section):
    minimum: list[float]
    maximum: list[float]

    def scale(self) -> Normalisation:
        return Normalisation(np.array(self.minimum), np.array(self.maximum))


class _Network(_Section):
    activation: str
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    input_normalisation: _Extremes
    output_normalisation: _Extremes
    layers: list[_Layer]
    training: TrainingRecord

    @classmethod
    def of(cls, network: Network, record: TrainingRecord) -> dict[str, Any]:
        """What stands in a file."""
        scales = network.input_normalisation, network.output_normalisation
        inputs, outputs = ({k: v.tolist() for k, v in vars(scale).items()} for scale in scales)
        return {
            "activation": network.activation,
            "inputs": [asdict(quantity) for quantity in network.inputs],
            "outputs": [asdict(quantity) for quantity in network.outputs],
            "input_normalisation": inputs,
            "output_normalisation": outputs,
            "layers": [
                {"weights": matrix[:, :-1].tolist(), "bias": matrix[:, -1].tolist()}
                for matrix in network.weights
            ],
            "training": asdict(record),
        }

    def network(self) -> Network:
        """Raises FlexikError or ValueError when numbers do not belong together."""
        weights = tuple(
            np.column_stack([np.array(layer.weights), np.array(layer.bias)])
            for layer in self.layers
        )
        scales = self.input_normalisation.scale(), self.output_normalisation.scale()
        return Network(weights, self.activation, *scales, self.inputs, self.outputs)


class _File(_Section):
    format: Literal["flexik-networks"]
    version: Literal[3]
    networks: Annotated[list[_Network], Field(min_length=1)]


class _Attempt(_Section):
    trained: _Network | None
    record: TrainingRecord


def network_file(networks: Sequence[Trained]) -> Callable[[Path], None]:
    """Writer of a file of `networks`; raises DataError when a value is not finite."""
    documents = [_Network.of(*trained) for trained in networks]
    document = {"format": FORMAT, "version": VERSION, "networks": documents}

    def write(path: Path) -> None:
        try:
            text = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False)
        except ValueError as error:
            raise DataError(f"{path}: the network holds a value that is not finite") from error
        files.write_text(path, text + "\n")

    return write


def load_networks(path: Path | str) -> list[Trained]:
    """Networks and records of the file `path`.

    Raises
    ------
    DataError
        When the file is missing or damaged; the message names the file and the key.
    """
    try:
        text = Path(path).read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        found = _File.model_validate_json(text).networks
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise DataError(f"{path}: {key or 'no network file'}: {first['msg']}") from None
    try:
        return [(each.network(), each.training) for each in found]
    except (FlexikError, ValueError) as error:
        raise DataError(f"{path}: {error}") from None


def load_network(path: Path | str) -> Trained:
    """As `load_networks`, of a file with one network."""
    found = load_networks(path)
    if len(found) != 1:
        raise DataError(f"{path}: holds {len(found)} networks, expected one")
    return found[0]


def load_restarts(path: Path | str) -> dict[int, Network]:
    """As `load_networks`, by the number of the restart."""
    return {record.restart: network for network, record in load_networks(path)}


def packed(network: Network | None, record: TrainingRecord) -> dict[str, np.ndarray]:
    """Arrays that hold a network, None where training failed, and its record."""
    trained = None if network is None else _Network.of(network, record)
    text = json.dumps({"trained": trained, "record": asdict(record)})
    return {"json": np.frombuffer(text.encode(), dtype=np.uint8)}


def unpacked(arrays: Arrays) -> tuple[Network | None, TrainingRecord]:
    """What was `packed`."""
    found = _Attempt.model_validate_json(arrays["json"].tobytes())
    return None if found.trained is None else found.trained.network(), found.record
