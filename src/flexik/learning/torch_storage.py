"""Modules of torch as JSON: exact float64, no pickle; a class is named, its code is elsewhere."""

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from flexik import files
from flexik.errors import DataError, FlexikError
from flexik.learning.perceptron import Array, Normalisation
from flexik.learning.storage import TrainingRecord
from flexik.learning.torch_module import Module, Trained


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Module(_Section):
    module: dict[str, Any]
    minimum: tuple[list[float], list[float]]
    maximum: tuple[list[float], list[float]]
    arrays: dict[str, Any]
    training: TrainingRecord

    @classmethod
    def of(cls, found: Module, record: TrainingRecord) -> dict[str, Any]:
        """What stands in a file."""
        scales = found.input_normalisation, found.output_normalisation
        return {
            "module": dict(found.given),
            "minimum": [scale.minimum.tolist() for scale in scales],
            "maximum": [scale.maximum.tolist() for scale in scales],
            "arrays": {name: array.tolist() for name, array in found.arrays.items()},
            "training": dataclasses.asdict(record),
        }

    def found(self) -> Module:
        arrays = {name: np.array(values, dtype=float) for name, values in self.arrays.items()}
        ends = zip(self.minimum, self.maximum, strict=True)
        scales = (Normalisation(*map(np.array, pair)) for pair in ends)
        return Module(self.module, arrays, *scales)


class _File(_Section):
    format: Literal["flexik-modules"]
    version: Literal[1]
    modules: list[_Module]


class _Attempt(_Section):
    module: _Module | None
    record: TrainingRecord


def module_file(modules: Sequence[Trained]) -> Callable[[Path], None]:
    """Writer of a file of `modules`: JSON, exact float64."""
    found = [_Module.of(*trained) for trained in modules]
    document = {"format": "flexik-modules", "version": 1, "modules": found}
    text = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False)
    return lambda path: files.write_text(path, text + "\n")


def load_modules(path: Path | str) -> list[Trained]:
    """Modules and records of the file `path`; raises DataError when it is missing or damaged."""
    try:
        found = _File.model_validate_json(Path(path).read_bytes()).modules
        return [(each.found(), each.training) for each in found]
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise DataError(f"{path}: {key or 'no file of modules'}: {first['msg']}") from None
    except (FlexikError, ValueError) as error:
        raise DataError(f"{path}: {error}") from None


def packed(module: Module | None, record: TrainingRecord) -> dict[str, Array]:
    """Arrays that hold a module, None where training failed, and its record."""
    given = None if module is None else _Module.of(module, record)
    text = json.dumps({"module": given, "record": dataclasses.asdict(record)})
    return {"json": np.frombuffer(text.encode(), dtype=np.uint8)}


def unpacked(arrays: Mapping[str, np.ndarray]) -> tuple[Module | None, TrainingRecord]:
    """What was `packed`."""
    found = _Attempt.model_validate_json(arrays["json"].tobytes())
    return None if found.module is None else found.module.found(), found.record
