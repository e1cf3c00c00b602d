"""What a .rrd file holds, read by rerun's own reader."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

from chladni.signals.arrays import Real, Whole


class Contents:
    """Entities of the one recording and the names in the one blueprint of a file."""

    def __init__(self, path: Path) -> None:
        reader = RrdReader(path)
        (recording,), (blueprint,) = reader.recordings(), reader.blueprints()
        # Kept as they are until a test asks: a file has ten times the rows that any test looks at.
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self._static: dict[str, list[pa.RecordBatch]] = {}
        for chunk in reader.stream(store=recording):
            kept = self._static if chunk.is_static else self._batches
            kept.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
        self.blueprint = [row for chunk in reader.stream(store=blueprint) for row in _rows(chunk.to_record_batch())]

    def entities(self) -> set[str]:
        return set(self._batches) | set(self._static)

    def static(self, entity: str) -> dict[str, Any]:
        return {key: value for batch in self._static[entity] for key, value in _rows(batch)[0].items()}

    def column(self, entity: str, name: str) -> list[Any]:
        """One column of an entity's rows in the order of time; None where a row lacks it."""
        batches = [
            batch.select([key for key in ("time", name) if key in batch.schema.names])
            for batch in self._batches[entity]
        ]
        rows = sorted((row for batch in batches for row in _rows(batch)), key=lambda row: row["time"])
        return [row.get(name) for row in rows]

    def times(self, entity: str, timeline: str) -> Whole:
        return np.array(self.column(entity, timeline), dtype=np.int64)

    def scalars(self, entity: str) -> Real:
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
