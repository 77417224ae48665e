"""Parquet tables whose columns carry units.

A table is read back only if its columns, types and units are the expected ones and the checksum of
every page holds. The bytes depend on the data alone, for one version of pyarrow.
"""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from flexik.errors import DataError
from flexik.files import atomic_path

FORMAT_VERSION = "1"
ROWS_PER_GROUP = 16_384

_TYPES = {"float64": pa.float64(), "int64": pa.int64(), "string": pa.string()}


@dataclass(frozen=True)
class Field:
    """A column: its name, SI unit ("1" for pure numbers), meaning and type.

    `dtype` is float64, int64 or string.
    """

    name: str
    unit: str
    description: str
    dtype: str = "float64"

    def __post_init__(self) -> None:
        if self.dtype not in _TYPES:
            raise DataError(f"field {self.name}: {self.dtype=}, expected one of {list(_TYPES)}")


def write_table(
    path: Path | str, columns: Mapping[str, np.ndarray], fields: Sequence[Field]
) -> None:
    """Write `columns`, an array (n_rows,) of the right type for every field, whole or not at all.

    Raises DataError if the columns are not exactly the fields, or differ in length, shape or type.
    """
    _compare_names(path, list(columns), fields)
    arrays = [_arrow_array(path, field, columns[field.name]) for field in fields]
    lengths = {field.name: len(array) for field, array in zip(fields, arrays, strict=True)}
    if len(set(lengths.values())) > 1:
        raise DataError(f"{path}: expected columns of equal length, got {lengths}")
    table = pa.Table.from_arrays(arrays, schema=_schema(fields))
    with (
        atomic_path(path) as temporary,
        pq.ParquetWriter(
            temporary, table.schema, compression="zstd", write_page_checksum=True
        ) as writer,
    ):
        writer.write_table(table, row_group_size=ROWS_PER_GROUP)


def read_table(path: Path | str, fields: Sequence[Field] | None = None) -> pd.DataFrame:
    """Table of `path`, columns in the order of `fields` (None: those it has, in its order).

    Raises
    ------
    DataError
        If the file is missing or damaged, or has other columns, types or units than `fields`.
    """
    with _open(path) as file:
        schema, texts = file.schema_arrow, _texts(file.schema_arrow.metadata)
        if (version := texts.get("format_version")) != FORMAT_VERSION:
            raise DataError(f"{path}: expected a table of format {FORMAT_VERSION}, got {version}")
        if fields is not None:
            _compare_schema(path, schema, fields)
        _check_counts(path, file.metadata)
        table = file.read()
    names = schema.names if fields is None else [field.name for field in fields]
    return table.select(names).to_pandas()


def stored_fields(path: Path | str) -> list[Field]:
    """Fields of the table `path`, in its order.

    Raises
    ------
    DataError
        If the file is missing, damaged, or not written by `write_table`.
    """
    names = {arrow: name for name, arrow in _TYPES.items()}
    with _open(path) as file:
        schema = file.schema_arrow
    fields = []
    for column in schema:
        texts = _texts(column.metadata)
        if column.type not in names or not {"unit", "description"} <= texts.keys():
            raise DataError(f"{path}, column {column.name}: expected a unit and a known type")
        unit, description = texts["unit"], texts["description"]
        fields.append(Field(column.name, unit, description, names[column.type]))
    return fields


def _schema(fields: Sequence[Field]) -> pa.Schema:
    columns = [
        pa.field(
            field.name,
            _TYPES[field.dtype],
            nullable=False,
            metadata={"unit": field.unit, "description": field.description},
        )
        for field in fields
    ]
    return pa.schema(columns, metadata={"format_version": FORMAT_VERSION})


def _arrow_array(path: Path | str, field: Field, values: np.ndarray) -> pa.Array:
    values = np.asarray(values)
    if values.ndim != 1:
        raise DataError(f"{path}, column {field.name}: expected one axis, got {values.shape=}")
    if field.dtype == "string":
        fits = values.dtype.kind == "U" or all(isinstance(value, str) for value in values)
    else:
        # a silent cast could lose digits
        fits = values.dtype == np.dtype(field.dtype)
    if not fits:
        raise DataError(f"{path}, column {field.name}: expected {field.dtype}, got {values.dtype}")
    # NaN stays NaN: a null would need another meaning
    return pa.array(values, type=_TYPES[field.dtype], from_pandas=False)


def read_csv(
    path: Path | str, columns: Sequence[str], texts: Sequence[str] = (), keys: Sequence[str] = ()
) -> pd.DataFrame:
    """CSV table `path` with at least the numbers `columns` and the texts `texts`.

    Raises DataError if it is missing, damaged or has no row, or two rows with the same `keys`.
    """
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise DataError(f"{path}: expected a CSV table ({reason})") from None
    if missing := [name for name in (*texts, *columns) if name not in table]:
        raise DataError(f"{path}: expected columns {[*texts, *columns]}, but {missing} missing")
    for name in columns:
        if table[name].dtype.kind not in "fiu":
            raise DataError(f"{path}, column {name}: expected numbers")
    if table.empty:
        raise DataError(f"{path}: expected at least one row")
    if keys and (again := table.duplicated(list(keys))).any():
        number = int(np.flatnonzero(again)[0])
        raise DataError(f"{path}, row {number + 1}: its {', '.join(keys)} stand in a row before")
    return table


@contextlib.contextmanager
def _open(path: Path | str) -> Iterator[pq.ParquetFile]:
    """Open `path`; whatever Arrow dislikes while it is open becomes a DataError."""
    if not Path(path).is_file():
        raise DataError(f"{path}: no such file")
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            yield file
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        raise DataError(f"{path}: expected an undamaged Parquet file, but {reason}") from error


def _check_counts(path: Path | str, metadata: pq.FileMetaData) -> None:
    """No checksum covers the numbers of rows, but each stands there several times."""
    groups = [metadata.row_group(k) for k in range(metadata.num_row_groups)]
    counts = {g.column(k).num_values - g.num_rows for g in groups for k in range(g.num_columns)}
    if counts - {0} or sum(group.num_rows for group in groups) != metadata.num_rows:
        raise DataError(f"{path}: expected an undamaged Parquet file, but its row counts differ")


def _texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in (metadata or {}).items()}


def _compare_names(path: Path | str, names: Sequence[str], fields: Sequence[Field]) -> None:
    expected = [field.name for field in fields]
    if missing := [name for name in expected if name not in names]:
        raise DataError(f"{path}: expected columns {expected}, but {missing} missing")
    if extra := [name for name in names if name not in expected]:
        raise DataError(f"{path}: expected columns {expected}, but found {extra} too")
    if len(names) != len(expected):
        raise DataError(f"{path}: expected columns {expected}, each once, got {list(names)}")


def _compare_schema(path: Path | str, schema: pa.Schema, fields: Sequence[Field]) -> None:
    _compare_names(path, schema.names, fields)
    for field in fields:
        column = schema.field(field.name)
        if column.type != _TYPES[field.dtype]:
            raise DataError(
                f"{path}, column {field.name}: expected {field.dtype}, got {column.type}"
            )
        if (unit := _texts(column.metadata).get("unit")) != field.unit:
            raise DataError(
                f"{path}, column {field.name}: expected unit {field.unit!r}, got {unit!r}"
            )
