"""Opens a gathered table in pyarrow, DuckDB and polars; prints what each of them found, as JSON."""

import csv
import json
import math
import sys

import duckdb
import polars
import pyarrow.parquet

parquet, table = sys.argv[1:]
with open(table, newline="", encoding="utf-8") as file:
    rows = list(csv.DictReader(file))
names = list(rows[0])

arrow = pyarrow.parquet.read_table(parquet)
connection = duckdb.connect()
duck = connection.execute("SELECT * FROM read_parquet(?)", [parquet])
duck_names = [column[0] for column in duck.description]
duck_rows = duck.fetchall()
duck_types = {name: kind for name, kind, *_ in connection.execute("DESCRIBE SELECT * FROM read_parquet(?)", [parquet]).fetchall()}
polar = polars.read_parquet(parquet)

columns = {
    "pyarrow": {name: arrow.column(name).to_pylist() for name in arrow.column_names},
    "duckdb": {name: [row[column_index] for row in duck_rows] for column_index, name in enumerate(duck_names)},
    "polars": {name: polar[name].to_list() for name in polar.columns},
}
types = {
    "pyarrow": {field.name: str(field.type) for field in arrow.schema},
    "duckdb": duck_types,
    "polars": {name: str(kind) for name, kind in polar.schema.items()},
}
metadata = {
    "pyarrow": {key.decode(): value.decode() for key, value in arrow.schema.metadata.items()},
    "duckdb": {
        bytes(key).decode(): bytes(value).decode()
        for key, value in connection.execute("SELECT key, value FROM parquet_kv_metadata(?)", [parquet]).fetchall()
    },
    "polars": polars.read_parquet_metadata(parquet),
}


def equal(value, text):
    """Whether a value is what the CSV file says."""
    if value is None:
        return text == ""
    if isinstance(value, bool):
        return text == str(value).lower()
    if isinstance(value, (int, float)):
        return text != "" and (float(text) == value or math.isnan(value))
    return text == value


compared = 0
for tool, found in columns.items():
    assert list(found) == names, (tool, set(found) ^ set(names))
    for name in names:
        assert len(found[name]) == len(rows), (tool, name)
        for value, row in zip(found[name], rows):
            assert equal(value, row[name]), (tool, name, value, row[name])
            compared += 1

SAME = {
    "string": {"pyarrow": "string", "duckdb": "VARCHAR", "polars": "String"},
    "int64": {"pyarrow": "int64", "duckdb": "BIGINT", "polars": "Int64"},
    "double": {"pyarrow": "double", "duckdb": "DOUBLE", "polars": "Float64"},
    "boolean": {"pyarrow": "bool", "duckdb": "BOOLEAN", "polars": "Boolean"},
}
units = {}
for tool, found in metadata.items():
    described = json.loads(found["sensel.columns"])
    assert [column["name"] for column in described] == names, tool
    for column in described:
        own = types[tool][column["name"]]
        assert own == SAME[column["type"]][tool], (tool, column, own)
    units[tool] = {column["name"]: column["unit"] for column in described}
assert units["pyarrow"] == units["duckdb"] == units["polars"]

print(json.dumps({"compared": compared, "columns": len(names), "rows": len(rows), "units": units["pyarrow"]}))
