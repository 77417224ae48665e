"""Networks as JSON: exact float64, the same bytes for the same network, readable anywhere.

The file holds the weights, the normalisation, names and units, and the training record without
its wall time. Its formula is that of `flexik.learning.perceptron.Network`.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from flexik import files
from flexik.errors import DataError, FlexikError
from flexik.learning.perceptron import ACTIVATIONS, Array, Network, Normalisation, Quantity
from flexik.learning.training import StopReason, TrainingRecord

FORMAT = "flexik-network"
VERSION = 2


def save_network(
    path: Path | str, network: Network, record: TrainingRecord, parameters_checksum: str
) -> None:
    """Write `network` and `record` to `path`, whole or not at all.

    Parameters
    ----------
    parameters_checksum : of the parameters and data that made the network

    Raises
    ------
    DataError
        When a value is not finite; the message names the file.
    """
    training = asdict(record)
    # a wall time would change the bytes of an unchanged network
    del training["seconds"]
    document = {
        "format": FORMAT,
        "version": VERSION,
        "parameters_checksum": parameters_checksum,
        "activation": network.activation,
        "inputs": [asdict(quantity) for quantity in network.inputs],
        "outputs": [asdict(quantity) for quantity in network.outputs],
        "input_normalisation": _normalisation_lists(network.input_normalisation),
        "output_normalisation": _normalisation_lists(network.output_normalisation),
        "layers": [
            {"weights": matrix[:, :-1].tolist(), "bias": matrix[:, -1].tolist()}
            for matrix in network.weights
        ],
        "training": training,
    }
    try:
        text = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False)
    except ValueError as error:
        raise DataError(f"{path}: the network holds a value that is not finite") from error
    files.write_text(path, text + "\n")


def load_network(
    path: Path | str, parameters_checksum: str | None = None
) -> tuple[Network, TrainingRecord]:
    """Read what `save_network` wrote; `seconds` of the record is nan.

    Parameters
    ----------
    parameters_checksum : when given, the file must carry the same one

    Raises
    ------
    DataError
        When the file is missing, damaged or made with other parameters; the message names the
        file and the key.
    """
    top = _Section(path, "", _read(path))
    if top.get("format", str) != FORMAT:
        top.fail("format", f"expected {FORMAT!r}")
    if top.get("version", int) != VERSION:
        top.fail("version", f"expected {VERSION}")
    found = top.get("parameters_checksum", str)
    if parameters_checksum is not None and found != parameters_checksum:
        top.fail("parameters_checksum", f"is {found}, expected {parameters_checksum}")
    activation = top.get("activation", str)
    if activation not in ACTIVATIONS:
        top.fail("activation", f"is {activation!r}, expected one of {ACTIVATIONS}")
    inputs, outputs = _quantities(top, "inputs"), _quantities(top, "outputs")
    p, q = len(inputs), len(outputs)
    network = Network(
        weights=_layers(top, p, q),
        activation=activation,
        input_normalisation=_normalisation(top, "input_normalisation", p),
        output_normalisation=_normalisation(top, "output_normalisation", q),
        inputs=inputs,
        outputs=outputs,
    )
    return network, _record(top.section("training"))


@dataclass(frozen=True)
class _Section:
    """An object of the document, which knows its file and its key."""

    path: Path | str
    prefix: str
    content: dict[str, Any]

    def fail(self, key: str, what: str) -> NoReturn:
        raise DataError(f"{self.path}: {self.prefix}{key} {what}")

    def get(self, key: str, *kinds: type) -> Any:
        if key not in self.content:
            self.fail(key, "is missing")
        value = self.content[key]
        # bool is an int to Python
        if isinstance(value, bool) or not isinstance(value, kinds):
            expected = " or ".join(kind.__name__ for kind in kinds)
            self.fail(key, f"is of type {type(value).__name__}, expected {expected}")
        return value

    def count(self, key: str) -> int:
        value: int = self.get(key, int)
        if value < 0:
            self.fail(key, f"is {value}, expected 0 or more")
        return value

    def section(self, key: str) -> "_Section":
        return _Section(self.path, f"{self.prefix}{key}.", self.get(key, dict))

    def array(self, key: str, shape: tuple[int | None, ...]) -> Array:
        try:
            array = np.array(self.get(key, list))
        except ValueError:
            self.fail(key, "has rows of different lengths")
        named = tuple("any" if size is None else size for size in shape)
        if array.ndim != len(shape) or any(
            size not in (None, found) for size, found in zip(shape, array.shape, strict=True)
        ):
            self.fail(key, f"has shape {array.shape}, expected {named}")
        # an empty list reads as float64, text as "U", null and mixtures as "O"
        if array.dtype.kind not in "if" or not np.isfinite(array).all():
            self.fail(key, "holds something other than finite numbers")
        return array.astype(np.float64)


def _read(path: Path | str) -> dict[str, Any]:
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise DataError(f"{path}: there is no such network file") from error
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path}: is not valid JSON ({error})") from error
    if not isinstance(document, dict):
        raise DataError(f"{path}: holds a JSON {type(document).__name__}, expected an object")
    return document


def _normalisation_lists(normalisation: Normalisation) -> dict[str, list[float]]:
    return {
        "minimum": normalisation.minimum.tolist(),
        "maximum": normalisation.maximum.tolist(),
    }


def _normalisation(top: _Section, key: str, n_columns: int) -> Normalisation:
    section = top.section(key)
    minimum = section.array("minimum", (n_columns,))
    maximum = section.array("maximum", (n_columns,))
    try:
        return Normalisation(minimum, maximum)
    except FlexikError as error:
        raise DataError(f"{top.path}: {key}: {error}") from error


def _layers(top: _Section, n_inputs: int, n_outputs: int) -> tuple[Array, ...]:
    entries = top.get("layers", list)
    if len(entries) < 2:
        top.fail("layers", f"holds {len(entries)}, expected a hidden layer and the output layer")
    matrices: list[Array] = []
    for index, section in enumerate(_sections(top, "layers", "weights and bias")):
        n_units = n_outputs if index == len(entries) - 1 else None
        bias = section.array("bias", (n_units,))
        n_columns = len(matrices[-1]) if matrices else n_inputs
        weights = section.array("weights", (bias.size, n_columns))
        matrices.append(np.column_stack([weights, bias]))
    return tuple(matrices)


def _sections(top: _Section, key: str, content: str) -> Iterator[_Section]:
    for index, entry in enumerate(top.get(key, list)):
        if not isinstance(entry, dict):
            top.fail(f"{key}[{index}]", f"is not an object with {content}")
        yield _Section(top.path, f"{key}[{index}].", entry)


def _quantities(top: _Section, key: str) -> tuple[Quantity, ...]:
    if not top.get(key, list):
        top.fail(key, "is empty")
    sections = _sections(top, key, "name and unit")
    return tuple(Quantity(each.get("name", str), each.get("unit", str)) for each in sections)


def _record(training: _Section) -> TrainingRecord:
    reason = training.get("stop_reason", str)
    if reason not in list(StopReason):
        training.fail("stop_reason", f"is {reason!r}, expected one of {', '.join(StopReason)}")
    selection_error = training.get("selection_error", float, type(None))
    if selection_error is not None and not math.isfinite(selection_error):
        training.fail("selection_error", "is not finite")
    return TrainingRecord(
        trainer=training.get("trainer", str),
        seed=training.count("seed"),
        stop_reason=StopReason(reason),
        errors=tuple(training.array("errors", (None,)).tolist()),
        kept=training.count("kept"),
        selection_error=selection_error,
        restart=training.count("restart"),
        n_restarts=training.count("n_restarts"),
        seconds=math.nan,
    )
