"""A model that runs away by itself is told before any answer; one that is only free isn't."""

from dataclasses import replace

import numpy as np

from chladni.gap.comparison.measuring import matched_log
from chladni.gap.comparison.unstable_model import instability, instability_found
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.gap.design.close_candidates import axis
from tests.gap.made_log import chain, three_bodies

#: Of ``10 s^3 + 30 s^2 + 2000 s + ki``: at 6000 two poles lie on the imaginary axis, at 200 rad^2/s^2 (Routh).
EDGE = 6000.0


def loop(ki: float) -> StructureModel:
    """The carriage of 10 kg and 30 N s/m under a PI controller of its position."""
    controller = Controller(
        name="loop", reference="/ref", feedback="position", drives="motor", law="pi", gains={"kp": 2000.0, "ki": ki},
        gain=1.0,
    )  # fmt: skip
    return replace(axis(), controllers=(controller,))


def test_a_loop_beyond_its_edge_is_told_with_pole_and_growth() -> None:
    assert instability("axis", loop(0.95 * EDGE).compile()) is None
    unstable = loop(1.2 * EDGE).compile()
    told = instability("axis", unstable)
    worst = max(np.linalg.eigvals(unstable.a), key=lambda pole: (pole.real, pole.imag))
    assert told is not None
    assert told.startswith(
        f"model 'axis' is unstable: a pole at {worst.real:.4g} ± {worst.imag:.4g}j rad/s, so that any error grows "
        f"e-fold in {1 / worst.real:.2g} s; "
    )
    assert "check the gains, signs and units of its loops" in told


def test_what_is_only_free_is_not_unstable() -> None:
    free = three_bodies().structure
    loose = replace(three_bodies(), structure=replace(free, joints=free.joints[1:]))
    assert np.sum(np.abs(np.linalg.eigvals(loose.compile().a)) < 1e-3) == 2
    for model in (axis(), loose, chain([1.0], [1e4], [0.0])):
        assert instability("free", model.compile()) is None


def test_a_late_loop_is_unstable_too() -> None:
    late = loop(0.5 * EDGE).with_effects([attached("delay", "motor", {"delay": 0.1})])
    assert "unstable" in (instability("axis", late.compile()) or "")


def test_stability_that_what_was_found_changes_is_told() -> None:
    stable, unstable = loop(0.5 * EDGE).compile(), loop(1.2 * EDGE).compile()
    assert "model is unstable: a pole at " in (instability_found(stable, unstable) or "")
    assert (instability_found(unstable, stable) or "").endswith("found the model is stable")
    assert instability_found(stable, stable) is None
    # That was said before the answer.
    assert instability_found(unstable, unstable) is None


def test_it_is_said_before_the_answer() -> None:
    channels = (
        Channel(name="/ref", unit="m"),
        Channel(name="position", unit="m"),
        Channel(name="speed", unit="m/s"),
    )
    values = np.random.default_rng(0).standard_normal((3, 2000))
    log = TimeSeries(values=values, sample_rate_hz=500.0, channels=channels)
    (told,) = matched_log(loop(1.2 * EDGE), log, log="log.mcap").warnings
    assert told == instability("axis", loop(1.2 * EDGE).compile())
    assert matched_log(loop(0.5 * EDGE), log, log="log.mcap").warnings == ()
