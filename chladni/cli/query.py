"""``chladni query``: SQL over the tables of a study."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import NOTHING, number
from chladni.signals.wording import counted

if TYPE_CHECKING:
    import pyarrow as pa


def query(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study.", show_default=False)],
    sql: Annotated[
        str, typer.Argument(metavar="SQL", help='Such as "select log, frequency_hz from modes".', show_default=False)
    ],
    *,
    json: options.Json = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Write the answer as a table.", show_default=False)
    ] = None,
) -> None:
    """Ask the tables of a study in SQL (DuckDB); nothing is written, and no other file is read."""
    from chladni.io.study.results import plain_rows, results

    require_places(reads=(), writes={"--json": json, "--csv": csv})
    out = Output(json)
    answer = results(directory).query(sql)
    rows = plain_rows(answer)
    columns = list(answer.schema.names)
    if not columns:
        out.line("done; the question gives no rows")
    else:
        cells = [[_cell(row[one]) for one in columns] for row in rows]
        texts = [place for place, field in enumerate(answer.schema) if not _is_number(field.type)]
        out.table(counted(answer.num_rows, "row"), columns, cells, texts=texts)
    out.json(lambda: {"format": "chladni.query/1", "columns": columns, "rows": [_plain(row) for row in rows]})
    if csv is not None:
        from chladni.io.study.results import write_answer

        out.line(f"table: {write_answer(csv, answer)}")


def _is_number(kind: "pa.DataType") -> bool:
    import pyarrow.types as kinds

    return bool(kinds.is_integer(kind) or kinds.is_floating(kind) or kinds.is_decimal(kind))


def _cell(value: Any) -> str:
    match value:
        case None:
            return NOTHING
        case bool():
            return "yes" if value else "no"
        case float():
            return number(value, digits=6)
        case list():
            return ", ".join(map(_cell, value))
    return str(value)


def _plain(value: Any) -> Any:
    """Give a value as JSON has it; NaN and infinity become null, days and times are text."""
    from math import isfinite

    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [*map(_plain, value)]
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value.isoformat() if hasattr(value, "isoformat") else str(value)
