"""Parquet tables whose columns carry units, and whose schema names the parameters that made them.

A table is read back only if its columns, types, units and parameters are the expected ones and
the checksum of every page holds. The bytes depend on the data alone, for one version of pyarrow.
"""

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
    path: Path | str,
    columns: Mapping[str, np.ndarray],
    fields: Sequence[Field],
    parameters_checksum: str,
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write `columns` to `path`, whole or not at all.

    Parameters
    ----------
    path
        Parquet file to write; its folder is made if needed.
    columns
        One array of shape (n_rows,) and of the field's own type for every field.
    fields
        The columns, in the order of the file.
    parameters_checksum
        Checksum of the parameters the data depend on.
    metadata
        Further texts to keep in the schema.

    Raises
    ------
    DataError
        If the columns are not exactly the fields, or differ in length, shape or type.
    """
    schema = _schema(path, fields, parameters_checksum, metadata or {})
    _compare_names(path, list(columns), fields)
    arrays = [_arrow_array(path, field, columns[field.name]) for field in fields]
    lengths = {field.name: len(array) for field, array in zip(fields, arrays, strict=True)}
    if len(set(lengths.values())) > 1:
        raise DataError(f"{path}: expected columns of equal length, got {lengths}")
    _write_rows(path, schema, [pa.Table.from_arrays(arrays, schema=schema)])


def read_table(
    path: Path | str, fields: Sequence[Field], parameters_checksum: str | None = None
) -> pd.DataFrame:
    """Table of `path`, columns in the order of `fields`.

    Raises
    ------
    DataError
        If the file is missing or damaged, has other columns, types or units than `fields`, or,
        when `parameters_checksum` is given, was made with other parameters.
    """
    return read_arrow(path, fields, parameters_checksum).to_pandas()


def read_arrow(
    path: Path | str, fields: Sequence[Field], parameters_checksum: str | None = None
) -> pa.Table:
    """As `read_table`, but an Arrow table (the other modules of this room read it)."""
    with _open(path) as file:
        _compare_schema(path, file.schema_arrow, fields, parameters_checksum)
        _check_counts(path, file.metadata)
        return file.read().select([field.name for field in fields])


def table_metadata(path: Path | str) -> dict[str, str]:
    """Texts kept in the schema of `path`: `parameters_checksum`, `format_version`, the caller's.

    Raises
    ------
    DataError
        If the file is missing or damaged.
    """
    with _open(path) as file:
        return _texts(file.schema_arrow.metadata)


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


def concatenate_tables(
    parts: Iterable[Path | str],
    path: Path | str,
    fields: Sequence[Field],
    parameters_checksum: str,
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write the rows of `parts`, in order, to `path`, with one part in memory at a time.

    The bytes are those `write_table` would write for all rows, however they are cut into parts.

    Raises
    ------
    DataError
        If a part cannot be read with these fields and this checksum; `path` is then untouched.
    """
    schema = _schema(path, fields, parameters_checksum, metadata or {})
    tables = (read_arrow(part, fields, parameters_checksum) for part in parts)
    _write_rows(path, schema, (table.cast(schema) for table in tables))


def _schema(
    path: Path | str, fields: Sequence[Field], checksum: str, metadata: Mapping[str, str]
) -> pa.Schema:
    own = {"format_version": FORMAT_VERSION, "parameters_checksum": checksum}
    if taken := own.keys() & metadata.keys():
        raise DataError(f"{path}: metadata must not contain the reserved keys {sorted(taken)}")
    columns = [
        pa.field(
            field.name,
            _TYPES[field.dtype],
            nullable=False,
            metadata={"unit": field.unit, "description": field.description},
        )
        for field in fields
    ]
    return pa.schema(columns, metadata=dict(sorted({**metadata, **own}.items())))


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


def _write_rows(path: Path | str, schema: pa.Schema, tables: Iterable[pa.Table]) -> None:
    """Write tables of `schema` one after the other, in row groups of a fixed length."""
    with (
        atomic_path(path) as temporary,
        pq.ParquetWriter(temporary, schema, compression="zstd", write_page_checksum=True) as writer,
    ):
        pending, n_pending = [schema.empty_table()], 0
        for table in tables:
            pending.append(table)
            n_pending += table.num_rows
            if n_pending >= ROWS_PER_GROUP:
                rows = pa.concat_tables(pending).combine_chunks()
                n_whole = n_pending // ROWS_PER_GROUP * ROWS_PER_GROUP
                writer.write_table(rows.slice(0, n_whole), row_group_size=ROWS_PER_GROUP)
                pending, n_pending = [rows.slice(n_whole)], n_pending - n_whole
        if n_pending:
            rows = pa.concat_tables(pending).combine_chunks()
            writer.write_table(rows, row_group_size=ROWS_PER_GROUP)


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


def _compare_schema(
    path: Path | str, schema: pa.Schema, fields: Sequence[Field], checksum: str | None
) -> None:
    found = _texts(schema.metadata)
    if (version := found.get("format_version")) != FORMAT_VERSION:
        raise DataError(f"{path}: expected a table of format {FORMAT_VERSION}, got {version}")
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
    if checksum is not None and (other := found.get("parameters_checksum")) != checksum:
        raise DataError(
            f"{path}: made with other parameters (checksum {other}), expected {checksum}"
        )
