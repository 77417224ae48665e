"""Tables keep data, units and checksum, and damage never passes for data."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexik.datasets.tables import Field, read_table, stored_fields, write_table
from flexik.errors import DataError

FIELDS = (
    Field("stroke", "m", "stroke of the lift cylinder"),
    Field("n_steps", "1", "load steps", "int64"),
    Field("mechanism", "1", "name of the mechanism", "string"),
)


def columns(n_rows: int = 60, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {
        "stroke": rng.normal(size=n_rows),
        "n_steps": rng.integers(0, 9, n_rows),
        "mechanism": rng.choice(["crane", "elastic_arm"], n_rows),
    }


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "grid.parquet"
    write_table(path, columns(), FIELDS)
    return path


def test_round_trip_keeps_values_order_and_types(tmp_path):
    path = tmp_path / "new" / "grid.parquet"
    data = columns()
    data["stroke"][:3] = np.nan, np.inf, -0.0
    write_table(path, dict(reversed(data.items())), FIELDS)
    frame = read_table(path, FIELDS)
    assert list(frame.columns) == ["stroke", "n_steps", "mechanism"]
    assert frame["stroke"].to_numpy().tobytes() == data["stroke"].tobytes()
    assert frame["n_steps"].dtype == np.int64
    np.testing.assert_array_equal(frame["n_steps"], data["n_steps"])
    assert frame["mechanism"].tolist() == data["mechanism"].tolist()


def test_units_and_descriptions_are_in_the_file(tmp_path):
    path = tmp_path / "grid.parquet"
    write_table(path, columns(), FIELDS)
    # read by pyarrow itself, as any other program would
    field = pq.read_schema(path).field("stroke")
    assert field.metadata[b"unit"] == b"m"
    assert field.metadata[b"description"] == b"stroke of the lift cylinder"
    assert stored_fields(path) == list(FIELDS)


def test_same_data_same_bytes_and_readable_by_others(tmp_path):
    write_table(tmp_path / "a", columns(), FIELDS)
    write_table(tmp_path / "b", columns(), FIELDS)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stroke": None}, r"\['stroke'\] missing"),
        ({"mass": np.zeros(60)}, r"found \['mass'\] too"),
        ({"stroke": np.zeros(59)}, "equal length, got .*59"),
        ({"stroke": np.zeros((60, 1))}, r"column stroke: .*\(60, 1\)"),
        ({"stroke": np.zeros(60, np.float32)}, "column stroke: expected float64, got float32"),
        ({"n_steps": np.zeros(60)}, "column n_steps: expected int64, got float64"),
        ({"mechanism": np.zeros(60)}, "column mechanism: expected string, got float64"),
        ({"mechanism": np.array(["a", None] * 30, object)}, "column mechanism: expected string"),
    ],
)
def test_wrong_columns_are_refused_and_the_old_file_stays(table, change, message):
    before = table.read_bytes()
    data = {k: v for k, v in {**columns(), **change}.items() if v is not None}
    with pytest.raises(DataError, match=f"grid.parquet.*{message}"):
        write_table(table, data, FIELDS)
    assert table.read_bytes() == before
    assert list(table.parent.iterdir()) == [table]


def test_a_failing_writer_leaves_the_old_file(table, monkeypatch):
    before = table.read_bytes()

    def fail(*args: object, **kwargs: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(pq.ParquetWriter, "write_table", fail)
    with pytest.raises(OSError, match="no space"):
        write_table(table, columns(seed=1), FIELDS)
    assert table.read_bytes() == before
    assert list(table.parent.iterdir()) == [table]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ((*FIELDS, Field("mass", "kg", "payload")), r"\['mass'\] missing"),
        (FIELDS[:2], r"found \['mechanism'\] too"),
        ((Field("stroke", "mm", ""), *FIELDS[1:]), "column stroke: expected unit 'mm', got 'm'"),
        ((Field("stroke", "m", "", "int64"), *FIELDS[1:]), "column stroke: expected int64, got d"),
    ],
)
def test_other_columns_units_or_types_are_told(table, fields, message):
    with pytest.raises(DataError, match=f"grid.parquet.*{message}"):
        read_table(table, fields)


def test_missing_and_foreign_files_are_told(tmp_path):
    path = tmp_path / "grid.parquet"
    for read in (stored_fields, read_table):
        with pytest.raises(DataError, match=r"grid\.parquet: no such file"):
            read(path)
    path.write_text("stroke,n_steps\n1,2\n")
    with pytest.raises(DataError, match=r"grid\.parquet: expected an undamaged Parquet file"):
        read_table(path, FIELDS)
    pq.write_table(pa.table({"stroke": [1.0]}), path)
    with pytest.raises(DataError, match=r"grid\.parquet: expected a table of format 1, got None"):
        read_table(path, FIELDS)


def test_bad_declarations_are_refused():
    with pytest.raises(DataError, match=r"field x: .*float32.*expected one of"):
        Field("x", "m", "", "float32")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, pd.DataFrame]:
    path = tmp_path_factory.mktemp("damage") / "grid.parquet"
    write_table(path, columns(), FIELDS)
    return path.with_name("damaged.parquet"), path.read_bytes(), read_table(path, FIELDS)


@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_a_truncated_file_never_reads(whole, data):
    path, content, _ = whole
    path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    with pytest.raises(DataError, match=r"damaged\.parquet"):
        read_table(path, FIELDS)


def test_a_changed_number_of_rows_is_noticed(whole):
    path, content, _ = whole
    # the 60 rows as a Thrift integer: of the columns, of the row group and of the file
    places = [k for k in range(len(content)) if content[k : k + 2] == b"\x16x"]
    assert len(places) >= 5
    for place in places:
        path.write_bytes(content[: place + 1] + b"p" + content[place + 2 :])
        with pytest.raises(DataError, match=r"damaged\.parquet"):
            read_table(path, FIELDS)


@given(data=st.data())
@settings(max_examples=300, deadline=None)
def test_a_changed_byte_is_noticed_or_harmless(whole, data):
    path, content, frame = whole
    position = data.draw(st.integers(0, len(content) - 1))
    changed = bytearray(content)
    changed[position] ^= data.draw(st.integers(1, 255))
    path.write_bytes(changed)
    try:
        read = read_table(path, FIELDS)
    except DataError as error:
        assert "damaged.parquet" in str(error)  # noqa: PT017
    else:
        pd.testing.assert_frame_equal(read, frame, check_exact=True)
