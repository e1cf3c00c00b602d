"""What an effect that is known already did beyond the linear model, while another one is looked for."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.measurement import Measurement
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.core.port import PortKind
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.value import Value

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownEffect(Value):
    """Taken from a log, the rest is a gap of a linear model again; but laws act along the whole motion.

    Attributes
    ----------
    outputs
        ``[output, sample]`` beyond those of the linear model at the same parameters.
    displacement, velocity
        ``[sample]`` of ports likewise, by name and kind.
    """

    outputs: Matrix
    displacement: Mapping[tuple[str, PortKind], Matrix]
    velocity: Mapping[tuple[str, PortKind], Matrix]

    def __post_init__(self) -> None:
        self._freeze()

    @classmethod
    def of(cls, run: FreeRun, fit: OutputErrorFit, effects: tuple[AttachedEffect, ...]) -> Self:
        """Give what effects of a fit did; where they aren't all of it, their own states begin at rest.

        Raises
        ------
        ModelError
            When the model diverges with or without them.
        """
        start = fit.initial[:, : len(run.compiled().states)]
        bent_start = fit.initial
        if len(effects) < len(fit.effects):
            own = len(run.compiled(fit.z, effects).states) - start.shape[1]
            bent_start = np.hstack([start, np.zeros((len(start), own))])
        plain, bent = run.motions(fit.z, (), start), run.motions(fit.z, effects, bent_start)
        return cls(
            outputs=run.outputs(fit.z, effects, bent_start) - run.outputs(fit.z, (), start),
            displacement={
                key: bent[key].displacement - one.displacement for key, one in plain.items() if key in bent
            },
            velocity={key: bent[key].velocity - one.velocity for key, one in plain.items() if key in bent},
        )

    def without(self, measurement: Measurement) -> Measurement:
        """Give the log as it would be but for the effect."""
        return replace(measurement, outputs=measurement.outputs - self.outputs)

    def behind(self, rest: Measurement) -> Measurement:
        """Give back the log of which `without` left the rest."""
        return replace(rest, outputs=rest.outputs + self.outputs)

    def along(self, motion: Recovered, rest: Measurement) -> Recovered:
        """Give the whole motion at a site of what was recovered from the rest of a log."""
        site = motion.site
        if site.kind == "output":
            row = rest.output_names.index(site.name)
            return replace(motion, displacement=motion.displacement + self.outputs[row])
        key = (site.name, site.kind)
        if key not in self.displacement:
            return motion
        return replace(
            motion,
            displacement=motion.displacement + self.displacement[key],
            velocity=motion.velocity + self.velocity[key],
        )
