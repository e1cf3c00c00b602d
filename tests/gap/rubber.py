"""A joint of rubber, which is no word of the catalogue."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel

#: Corners half a decade apart, from far below the first resonance to above the last.
CORNERS_HZ = (2.0, 6.3, 20.0, 63.0, 200.0)


@dataclass(frozen=True)
class Rubber:
    """Maxwell's branches across a joint, in matrices; `stiffness` of each in N/m."""

    site: str = "shoulder"
    stiffness: float = 1.5e4
    effect: str = "viscoelastic"

    @property
    def values(self) -> Mapping[str, float]:
        return {}

    def attach(self, compiled: CompiledModel) -> CompiledModel:
        joint, count, new = compiled.port_index(self.site, "joint"), len(compiled.states), len(CORNERS_HZ)
        force = np.zeros((len(compiled.ports), count + new))
        # A force at a joint is positive where it resists.
        force[joint, count:] = self.stiffness

        def widened(matrix: np.ndarray) -> np.ndarray:
            return np.hstack([matrix, np.zeros((len(matrix), new))])

        speeds = np.hstack([np.tile(compiled.velocity_state[joint], (new, 1)), -2 * np.pi * np.diag(CORNERS_HZ)])
        g = np.vstack([compiled.g, np.zeros((new, compiled.g.shape[1]))])
        return replace(
            compiled,
            a=np.vstack([widened(compiled.a), speeds]) + g @ force,
            b=np.vstack([compiled.b, np.tile(compiled.velocity_column[joint], (new, 1))]),
            g=g,
            c=widened(compiled.c) + compiled.h @ force,
            displacement_state=widened(compiled.displacement_state),
            velocity_state=widened(compiled.velocity_state),
            states=(*compiled.states, *(f"rubber{place}" for place in range(new))),
        )
