"""What a .rrd file holds, read by rerun's own reader."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from rerun.chunk import RrdReader


class Contents:
    """Entities of the one recording and the names in the one blueprint of a file."""

    def __init__(self, path: Path) -> None:
        reader = RrdReader(path)
        (recording,), (blueprint,) = reader.recordings(), reader.blueprints()
        self._rows: dict[str, list[dict[str, Any]]] = {}
        self._static: dict[str, dict[str, Any]] = {}
        for chunk in reader.stream(store=recording):
            rows = _rows(chunk.to_record_batch())
            if chunk.is_static:
                self._static.setdefault(chunk.entity_path, {}).update(rows[0])
            else:
                self._rows.setdefault(chunk.entity_path, []).extend(rows)
        self.blueprint = [row for chunk in reader.stream(store=blueprint) for row in _rows(chunk.to_record_batch())]

    def entities(self) -> set[str]:
        return set(self._rows) | set(self._static)

    def static(self, entity: str) -> dict[str, Any]:
        return self._static[entity]

    def column(self, entity: str, name: str) -> list[Any]:
        """One column of an entity's rows in the order of time; None where a row lacks it."""
        rows = sorted(self._rows[entity], key=lambda row: row["time"])
        return [row.get(name) for row in rows]

    def times(self, entity: str, timeline: str) -> NDArray[np.int64]:
        return np.array(self.column(entity, timeline), dtype=np.int64)

    def scalars(self, entity: str) -> NDArray[np.float64]:
        return np.array(self.column(entity, "Scalars:scalars"), dtype=np.float64)

    def view_names(self) -> list[str]:
        return [
            row["ViewBlueprint:display_name"][0] for row in self.blueprint if row.get("ViewBlueprint:display_name")
        ]


def _rows(batch: pa.RecordBatch) -> list[dict[str, Any]]:
    plain = {
        # Python has no times of nanoseconds.
        name: column.cast(pa.int64()) if pa.types.is_temporal(column.type) else column
        for name, column in zip(batch.schema.names, batch.columns, strict=True)
    }
    return pa.table(plain).to_pylist() if plain else []
