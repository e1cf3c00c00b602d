"""What is known while an effect is looked for: what another one did, and states that the machine went through."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.free_run import FreeRun, Windows
from chladni.gap.plant.linear_view import LinearView
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.records.measurement import Measurement
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.pair import TILDE
from chladni.signals.arrays import Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownEffect(Value):
    """Taken from a log, the rest is a gap of a linear model again; but laws act along the whole motion.

    ``outputs [output, sample]`` are those beyond the linear model's at the same parameters, displacement and velocity
    ``[sample]`` likewise those of ports, by name and kind.
    """

    outputs: Real
    displacement: Mapping[tuple[str, str], Real]
    velocity: Mapping[tuple[str, str], Real]

    def __post_init__(self) -> None:
        self._freeze()

    @classmethod
    def of(cls, run: FreeRun, fit: OutputErrorFit, effects: tuple[AttachedEffect, ...]) -> Self:
        """Give what effects of a fit did; where they aren't all of it, their own states begin at rest.

        Over windows a linear model would begin each at the machine's state, and what laws did before would be lost:
        there it's the linear response of the whole record to the laws' forces.

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
        if len(run.windows) > 1 and _only_laws(run, effects):
            return cls._of_forces(run, fit, {key: one.force - plain[key].force for key, one in bent.items()})
        return cls(
            outputs=run.outputs(fit.z, effects, bent_start) - run.outputs(fit.z, (), start),
            displacement={
                key: bent[key].displacement - one.displacement for key, one in plain.items() if key in bent
            },
            velocity={key: bent[key].velocity - one.velocity for key, one in plain.items() if key in bent},
        )

    @classmethod
    def _of_forces(cls, run: FreeRun, fit: OutputErrorFit, forces: Mapping[tuple[str, str], Real]) -> Self:
        measurement, compiled = run.measurement, run.compiled(fit.z)
        lines = all_lines(measurement.samples, measurement.sample_rate_hz)
        view = LinearView(compiled, lines, np.zeros_like(measurement.inputs), tuple(run.rows.tolist()))
        acting = [
            (view.way_of_port(place), lines.spectrum(forces[port.name, port.kind]))
            for place, port in enumerate(compiled.ports)
            if np.any(forces[port.name, port.kind])
        ]
        moved = {
            (port.name, port.kind): [lines.signal(one)[0] for one in view.motion(place, None, acting)]
            for place, port in enumerate(compiled.ports)
        }
        return cls(
            outputs=lines.signal(view.response(None, acting))[:, 0],
            displacement={key: one[0] for key, one in moved.items()},
            velocity={key: one[1] for key, one in moved.items()},
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
        parts = self._parts(site)
        return replace(
            motion,
            displacement=motion.displacement + sum(sign * self.displacement[key] for sign, key in parts),
            velocity=motion.velocity + sum(sign * self.velocity[key] for sign, key in parts),
        )

    def _parts(self, site: Site) -> list[tuple[float, tuple[str, str]]]:
        """Ports whose motions add up to a site's, each with its sign."""
        plain: list[tuple[float, tuple[str, str]]] = [(1.0, (site.name, site.kind))]
        if site.kind == "pair":
            plain = [(sign, (name, "body")) for sign, name in zip((-1.0, 1.0), site.name.split(TILDE), strict=True)]
        return [(sign, key) for sign, key in plain if key in self.displacement]


def _only_laws(run: FreeRun, effects: tuple[AttachedEffect, ...]) -> bool:
    """Whether effects add forces at ports and nothing else."""
    plain, bent = run.compiled(), run.compiled(None, effects)
    others = [field.name for field in fields(plain) if field.name != "laws"]
    return all(np.array_equal(getattr(plain, name), getattr(bent, name)) for name in others)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownStates(Value):
    """States of a whole record: ``values [state, sample]``, but for their means, which no accelerometer tells."""

    names: tuple[str, ...]
    values: Real

    def __post_init__(self) -> None:
        self._freeze()

    def at_starts(self, windows: Windows, names: Sequence[str]) -> Real:
        """``[window, state]`` of the named states at the windows' first samples; those that aren't known are zero."""
        found = np.zeros((len(windows), len(names)))
        first = [start for start, _ in windows]
        for place, name in enumerate(names):
            if name in self.names:
                found[:, place] = self.values[self.names.index(name), first]
        return found
