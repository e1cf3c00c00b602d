"""Influence coefficients as JSON: ``chladni.influence/1``."""

from typing import Any

import numpy as np

from chladni.models.core.reading import InfluenceTable
from chladni.signals.arrays import Real

FORMAT = "chladni.influence/1"


def influence_document(table: InfluenceTable) -> dict[str, Any]:
    """Give the document; what doesn't exist is None."""
    return {
        "format": FORMAT,
        "behaviour": list(table.behaviour),
        "construction": list(table.construction),
        "nominal": dict(zip(table.behaviour, _known(table.nominal), strict=True)),
        "change": dict(zip(table.construction, _known(table.change), strict=True)),
        "relative_change": [_known(row) for row in table.relative_change],
        "finite": [_known(row) for row in table.finite],
        "log_derivative": [_known(row) for row in table.log_derivative],
        "definitions": dict(zip(table.behaviour, table.definitions, strict=True)),
    }


def _known(numbers: Real) -> list[float | None]:
    return [float(number) if np.isfinite(number) else None for number in numbers]
