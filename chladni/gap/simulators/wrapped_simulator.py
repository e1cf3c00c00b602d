"""A simulator with effects wrapped around it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

from chladni.gap.simulators.effects_around import joint_law, with_signals_changed
from chladni.gap.simulators.simulator import Simulator, SimulatorResponse
from chladni.models.effects.wording import nearest
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

if TYPE_CHECKING:
    from chladni.models.effects.attached_effect import AttachedEffect


@dataclass(frozen=True, slots=True, kw_only=True)
class WrappedSimulator:
    """A simulator, numbers that were tuned, and effects at its inputs, joints and outputs.

    Attributes
    ----------
    simulator
        What simulates.
    values
        Parameters that differ from the simulator's own, by name.
    effects
        As `chladni.attached` makes them; at one site in the order of the signal.

    Raises
    ------
    ModelError
        When an effect's site is no input, output or joint of the simulator, or the effect can't act there.
    """

    simulator: Simulator
    values: Mapping[str, float] = field(default_factory=dict)
    effects: tuple["AttachedEffect", ...] = ()

    def __post_init__(self) -> None:
        self.simulator.parameters.with_values(self.values)
        known = [site for kind in ("input", "output", "joint") for site in self.sites(kind)]
        for effect in self.effects:
            if effect.site not in known:
                raise ModelError(
                    f"{effect.effect}: {self.simulator.name!r} has no {effect.site!r}; "
                    f"{nearest(effect.site, known, 'sites')}"
                )

    def sites(self, kind: str) -> list[str]:
        """Names of the inputs, outputs or joints."""
        if kind == "joint":
            return [joint.name for joint in self.simulator.joints]
        return [each.name for each in (self.simulator.inputs if kind == "input" else self.simulator.outputs)]

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the same with some parameters replaced."""
        return replace(self, values={**self.values, **values})

    def with_effects(self, effects: Sequence["AttachedEffect"]) -> Self:
        """Give the same with these effects in place of those it has."""
        return replace(self, effects=tuple(effects))

    def respond(self, inputs: Real, sample_rate_hz: float) -> SimulatorResponse:
        """Simulate from the start of the log.

        Parameters
        ----------
        inputs
            ``[input, sample]`` as the log holds them, SI.

        Returns
        -------
        What the sensors would record, and the motion at joints that carry effects.

        Raises
        ------
        ModelError
            When the simulation diverges, or an effect can't act at its site.
        """
        acting = with_signals_changed(inputs, sample_rate_hz, self.simulator.inputs, self._at("input"), "input")
        laws = {
            joint.name: joint_law(joint, found)
            for joint in self.simulator.joints
            if (found := [each for each in self._at("joint") if each.site == joint.name])
        }
        response = self.simulator.respond(acting, sample_rate_hz, values=self.values, joint_laws=laws)
        return replace(response, outputs=self.recorded(response.outputs, sample_rate_hz))

    def recorded(self, outputs: Real, sample_rate_hz: float) -> Real:
        """Give what sensors record of true outputs."""
        return with_signals_changed(outputs, sample_rate_hz, self.simulator.outputs, self._at("output"), "output")

    def _at(self, kind: str) -> list["AttachedEffect"]:
        names = self.sites(kind)
        return [effect for effect in self.effects if effect.site in names]
