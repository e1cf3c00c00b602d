"""What a study found: its tables, and SQL over them by DuckDB, which sees nothing else."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pyarrow as pa
from pyarrow import dataset as datasets

from chladni.io.atomic import atomic_path
from chladni.io.study.folder import require_study
from chladni.io.study.tables import ORDER, SCHEMAS
from chladni.signals.errors import EstimateError, LogError, SetupError
from chladni.signals.visible import cell_text

if TYPE_CHECKING:
    import duckdb
    import pandas as pd

_DAYS: Final = datasets.partitioning(pa.schema([("day", pa.date32())]), flavor="hive")
#: What locks DuckDB: SQL can read the tables that it's given, and neither files, nor the network, nor extensions, nor
#: Python's variables; and can't unlock it.
LOCKED: Final = (
    "SET autoinstall_known_extensions = false",
    "SET autoload_known_extensions = false",
    "SET python_enable_replacements = false",
    # An answer that outgrows memory would be written down elsewhere: the last that is set before files are shut.
    "SET temp_directory = ''",
    "SET enable_external_access = false",
    "SET lock_configuration = true",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyResults:
    """Results of a study; made by `results`.

    Attributes
    ----------
    path
        Its folder.
    """

    path: Path

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables; one that the recipe asked nothing for is empty."""
        return tuple(SCHEMAS)

    def table(self, name: str) -> pa.Table:
        """Give a whole table, sorted.

        Raises
        ------
        SetupError
            When there is no table of that name.
        LogError
            When it can't be read.
        """
        if name not in SCHEMAS:
            raise SetupError(f"{self.path}: no table {name!r:.60}; there are {', '.join(SCHEMAS)}")
        try:
            found = self._dataset(name).to_table().select(SCHEMAS[name].names)
        except (pa.ArrowException, OSError) as error:
            raise LogError(f"{self.path / name}: can't be read: {error!s:.200}") from error
        return found.sort_by([(column, "ascending") for column in ORDER[name]])

    def to_pandas(self, name: str) -> "pd.DataFrame":
        """Give a whole table as a data frame; errors as for `table`, and `SetupError` without pandas."""
        if find_spec("pandas") is None:
            raise SetupError("data frames need pandas, which isn't installed; pip install 'chladni[pandas]'")
        frame: pd.DataFrame = self.table(name).to_pandas()
        return frame

    def query(self, sql: str) -> pa.Table:
        """Ask in SQL, as DuckDB has it; the tables go by their names.

        Raises
        ------
        SetupError
            When DuckDB isn't installed, or refuses the question.

        Examples
        --------
        >>> results("bridge").query("select log, frequency_hz from modes where mode = 0")  # doctest: +SKIP
        """
        database = _database()
        try:
            with database.cursor() as connection:
                for name in SCHEMAS:
                    # To look into a folder of many days takes its time.
                    if name in sql.lower():
                        connection.register(name, self._dataset(name))
                answer: duckdb.DuckDBPyRelation | None = connection.sql(sql)
                # A statement that gives no rows, such as SET.
                return pa.table({}) if answer is None else answer.to_arrow_table()
        except database_error() as error:
            why = " ".join(str(error).split())
            raise SetupError(f"the question can't be answered: {why:.400}; tables: {', '.join(SCHEMAS)}") from error

    def _dataset(self, name: str) -> datasets.Dataset:
        folder = self.path / name
        if not folder.is_dir():
            return datasets.dataset(pa.table({field.name: pa.array([], field.type) for field in SCHEMAS[name]}))
        return datasets.dataset(
            folder, schema=SCHEMAS[name], format="parquet", partitioning=_DAYS, exclude_invalid_files=False
        )


def results(path: Path | str) -> StudyResults:
    """Open the results of a study.

    Parameters
    ----------
    path
        The folder that ``chladni study`` wrote.

    Raises
    ------
    SetupError
        When it's no such folder.

    Examples
    --------
    >>> found = results("bridge")  # doctest: +SKIP
    >>> found.query("select day, avg(frequency_hz) from modes where mode = 0 group by day")  # doctest: +SKIP
    """
    path = Path(path)
    require_study(path)
    return StudyResults(path=path)


def _database() -> "duckdb.DuckDBPyConnection":
    try:
        import duckdb
    except ImportError:
        raise SetupError("SQL needs DuckDB, which isn't installed; pip install 'chladni[cluster]'") from None
    connection = duckdb.connect(":memory:")
    for statement in LOCKED:
        connection.execute(statement)
    return connection


def database_error() -> type[Exception]:
    """Give the base of what DuckDB raises."""
    import duckdb

    error: type[Exception] = duckdb.Error
    return error


def plain_rows(table: pa.Table) -> list[Mapping[str, Any]]:
    """Give the rows of an answer as plain values.

    Raises
    ------
    EstimateError
        When two columns have one name, so that a row would lose one.
    """
    if len(set(table.schema.names)) < len(table.schema.names):
        raise EstimateError("two columns of the answer have one name; name them apart: select a.log as first, ...")
    rows: list[Mapping[str, Any]] = table.to_pylist()
    return rows


def write_answer(path: Path, answer: pa.Table) -> Path:
    """Write an answer as CSV (RFC 4180), 17 significant digits, an empty field for null; give the path.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    rows = ([_field(one) for one in row.values()] for row in plain_rows(answer))
    with atomic_path(path) as place, place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(answer.schema.names)
        writer.writerows(rows)
    return path


def _field(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(map(_field, value))
    if isinstance(value, float):
        return f"{value:.17g}" if isfinite(value) else ""
    return "" if value is None else cell_text(str(value))
