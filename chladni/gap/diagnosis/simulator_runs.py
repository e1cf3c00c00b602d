"""Runs of a simulator against one log: what they miss, on blocks that fits see and on those that they don't."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.comparison.shares import pooled_gap
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.simulators.simulator import Simulator
from chladni.gap.simulators.wrapped_simulator import WrappedSimulator
from chladni.models.core.simulation import PortMotion
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError, ModelError

#: Blocks that alternate between fitting and judging: long against a cycle, short against drift.
BLOCK_S = 0.75
#: Independent samples that a channel's mean square counts for: what a law misses is correlated over long stretches.
EFFECTIVE_SAMPLES = 200.0
#: Share of the noise's power under which a smaller error is no better.
_SOFT = 0.3
#: A noise-free log still has rounding, and a floor of nothing would make every error infinite.
_LEAST_NOISE = 1e-4
#: How far a parameter moves to find its slope, in sigmas.
_NUDGE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorRuns:
    """A simulator with the log that it's compared to.

    Attributes
    ----------
    wrapped
        The simulator, without the effects that are in question.
    measurement
        Inputs in the simulator's order, and those of its outputs that the log holds.
    floor
        ``[output]`` RMS of the noise, in the output's unit; rather too small than too large, but never quite zero.
    tunables
        Parameters that may move inside their tolerance.
    """

    wrapped: WrappedSimulator
    measurement: Measurement
    floor: Real
    tunables: Tunables

    @classmethod
    def of(cls, simulator: Simulator, measurement: Measurement, noise: NoiseFloor) -> "SimulatorRuns":
        """Make ready; `EstimateError` when the log is too short to keep a part of it out of the fits."""
        if measurement.duration_s < 4 * BLOCK_S:
            raise EstimateError(
                f"{measurement.log}: {measurement.duration_s:.3g} s are too short to judge a fit on other samples "
                f"than it saw; log at least {4 * BLOCK_S:g} s"
            )
        moving = [one for one in simulator.parameters.values() if one.tolerance > 0 and one.value != 0]
        level = np.sqrt(np.mean(measurement.outputs**2, axis=1))
        return cls(
            wrapped=WrappedSimulator(simulator=simulator),
            measurement=measurement,
            floor=np.maximum(_quietest(measurement.outputs, noise), _LEAST_NOISE * np.where(level > 0, level, 1.0)),
            tunables=Tunables(
                names=tuple(one.name for one in moving),
                nominal=np.array([one.value for one in moving]),
                tolerance=np.array([one.tolerance for one in moving]),
                units=tuple(one.unit for one in moving),
            ),
        )

    @property
    def training(self) -> Mask:
        """``[sample]``: every other block."""
        blocks = np.floor(np.arange(self.measurement.samples) / self.measurement.sample_rate_hz / BLOCK_S)
        return np.asarray(blocks % 2 == 0)

    def rows(self) -> list[int]:
        """Rows of the simulator's outputs that the log holds."""
        names = [each.name for each in self.wrapped.simulator.outputs]
        return [names.index(name) for name in self.measurement.output_names]

    def simulated(self, z: Real, effects: Sequence[AttachedEffect]) -> Real:
        """``[output, sample]`` of the outputs that the log holds, with parameters at z sigmas; may diverge."""
        return self.outputs_of(self.true_outputs(z, effects), effects)

    def true_outputs(self, z: Real, effects: Sequence[AttachedEffect]) -> Real:
        """``[simulator's output, sample]`` before effects at outputs."""
        outputs = self.wrapped.sites("output")
        inside = [effect for effect in effects if effect.site not in outputs]
        model = self.wrapped.with_values(self.tunables.values(z)).with_effects(inside)
        return model.respond(self.measurement.inputs, self.measurement.sample_rate_hz).outputs

    def outputs_of(self, true: Real, effects: Sequence[AttachedEffect]) -> Real:
        """``[output, sample]`` that sensors record of true outputs."""
        outputs = self.wrapped.sites("output")
        sensors = self.wrapped.with_effects([effect for effect in effects if effect.site in outputs])
        return sensors.recorded(true, self.measurement.sample_rate_hz)[self.rows()]

    def motions(self, z: Real, effects: Sequence[AttachedEffect]) -> tuple[PortMotion, ...]:
        """Motion at every joint."""
        from chladni.gap.simulators.effects_around import joint_law

        model = self.wrapped.with_values(self.tunables.values(z))
        simulator = model.simulator
        laws = {
            joint.name: joint_law(joint, [each for each in effects if each.site == joint.name])
            for joint in simulator.joints
        }
        inputs = self.measurement.inputs
        found = simulator.respond(inputs, self.measurement.sample_rate_hz, values=model.values, joint_laws=laws)
        return found.motions

    def missed(self, z: Real, effects: Sequence[AttachedEffect]) -> Real:
        """``[output, sample]`` of measured minus simulated, over the noise."""
        return self.over_noise(self.measurement.outputs - self.simulated(z, effects))

    def over_noise(self, signals: Real) -> Real:
        """Signals in the outputs' units, divided by each output's noise."""
        return np.asarray(signals / self.floor[:, None])

    def slopes(self, z: Real, effects: Sequence[AttachedEffect], base: Real) -> Real:
        """``[parameter, output, sample]``: change over the noise for a sigma of each parameter."""
        found = np.zeros((z.size, *base.shape))
        for place in range(z.size):
            # Inward, where the other side may lie outside of what is allowed.
            step = -_NUDGE if z[place] > 0 else _NUDGE
            moved = z.copy()
            moved[place] += step
            found[place] = self.over_noise(self.simulated(moved, effects) - base) / step
        return found

    def gap(self, outputs: Real) -> float:
        """Gap of simulated outputs ``[output, sample]`` on held-out blocks, over the RMS of what was measured."""
        held_out = ~self.training
        measured = self.measurement.outputs[:, held_out]
        return pooled_gap(measured - outputs[:, held_out], measured)

    def powers(self, missed: Real, samples: Mask) -> Real:
        """``[output]`` mean square over the noise's power, on these samples."""
        return np.asarray(np.mean(missed[:, samples] ** 2, axis=1))


def _quietest(outputs: Real, noise: NoiseFloor) -> Real:
    """``[output]`` RMS; where an estimate may hold distortion, no more than the top quarter of the band says."""
    window = np.hanning(outputs.shape[1])
    power = np.abs(np.fft.rfft(outputs * window, axis=1)) ** 2 / np.sum(window**2)
    quiet = np.sqrt(np.mean(power[:, 3 * power.shape[1] // 4 :], axis=1))
    return np.asarray(np.where(noise.upper_bound, np.minimum(noise.rms, quiet), noise.rms))


def log_likelihood(powers: Real) -> float:
    """What the mean squares of what is missed (over the noise's) say for a hypothesis, nats.

    The noise's size and what the law lacks besides it are unknown, and integrated out channel by channel:
    ``-N/2 sum ln(power + 0.3)``.
    """
    return float(-0.5 * EFFECTIVE_SAMPLES * np.sum(np.log(powers + _SOFT)))


def weights(powers: Real, samples: int) -> Real:
    """``[output]`` factor on what is missed, whose sum of squares then has the slope of `-2 log_likelihood`."""
    return np.asarray(np.sqrt(EFFECTIVE_SAMPLES / (samples * (powers + _SOFT))))


def can_act(runs: SimulatorRuns, effect: AttachedEffect) -> bool:
    """Whether the effect can be wrapped around the simulator at its site: some need a spring, or equations."""
    from chladni.gap.simulators.effects_around import joint_law, wire

    simulator = runs.wrapped.simulator
    joints = {joint.name: joint for joint in simulator.joints}
    try:
        if effect.site in joints:
            joint_law(joints[effect.site], [effect])
        elif effect.site in runs.wrapped.sites("input"):
            effect.attach(wire(simulator.inputs, "input"))
        else:
            effect.attach(wire(simulator.outputs, "output"))
    except ModelError:
        return False
    return True
