import json
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from chladni.apps.excitation_words import Run, excitation
from chladni.apps.simulated_log import Drive, default_run, simulate_log, write_simulated_log
from chladni.io.log import open_log
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.errors import ModelError, SetupError

STIFFNESS, MASS, DAMPING = 8000.0, 2.0, 8.0


def one_mass(*, stiffness: float = STIFFNESS) -> StructureModel:
    return StructureModel(
        name="one",
        structure=Structure(
            bodies=(Body(name="mass", mass=MASS),),
            joints=(Joint(name="spring", between=("ground", "mass"), stiffness=stiffness, damping=DAMPING),),
        ),
        inputs=(StructureInput(name="hammer", at="mass", channel="/hammer.wrench.force.x"),),
        outputs=(
            StructureOutput(name="acc", measures="acceleration", at="mass", channel="/mass.accel.linear.x"),
            StructureOutput(name="motion", measures="displacement", at="mass"),
        ),
    )


def test_the_log_carries_its_truth_beside_it_and_inside(tmp_path: Path) -> None:
    friction = attached("coulomb_friction", "spring", {"force": 2.0})
    made = simulate_log(one_mass().with_effects([friction]), Drive(level=10.0, seed=3, noise=0.01), seconds=2.0)
    written, beside = write_simulated_log(made, tmp_path / "one.mcap")
    truth = json.loads(beside.read_text())
    assert beside.name == "one.truth.json"
    assert truth["format"] == "chladni.truth/1"
    assert truth["parameters"]["spring.stiffness"] == {"value": STIFFNESS, "unit": "N/m"}
    (effect,) = truth["effects"]
    assert (effect["effect"], effect["site"], effect["parameters"]["force"]) == ("coulomb_friction", "spring", 2.0)
    omega = sqrt(STIFFNESS / MASS)
    assert truth["poles"][0]["frequency_hz"] == pytest.approx(omega / (2 * pi), rel=1e-9)
    assert truth["poles"][0]["damping_ratio"] == pytest.approx(DAMPING / (2 * MASS * omega), rel=1e-9)
    with (tmp_path / "one.mcap").open("rb") as file:
        (record,) = list(make_reader(file).iter_metadata())
    assert record.name == "chladni.truth"
    assert json.loads(record.metadata["truth"]) == truth
    with open_log(written.path) as log:
        names = [one["channel"] for one in truth["channels"]]
        np.testing.assert_array_equal(log.read(names).values, made.recorded.values)
    assert [one["role"] for one in truth["channels"]] == ["input", "output", "output"]


def test_sensor_noise_has_its_share_and_leaves_the_inputs_alone() -> None:
    clean, noisy = (simulate_log(one_mass(), Drive(seed=4, noise=noise), seconds=20.0) for noise in (0.0, 0.05))
    difference = noisy.recorded.values - clean.recorded.values
    assert np.all(difference[0] == 0)
    signal = np.sqrt(np.mean(clean.recorded.values[1:] ** 2, axis=1))
    share = np.sqrt(np.mean(difference[1:] ** 2, axis=1)) / signal
    # The deviation of a standard deviation from n samples is 1/sqrt(2 n) of it.
    np.testing.assert_allclose(share, 0.05, rtol=5 / sqrt(2 * clean.recorded.samples))
    np.testing.assert_array_equal(noisy.simulation.outputs.values, clean.simulation.outputs.values)


def test_a_recording_drives_the_model_again_to_the_same_motion() -> None:
    made = simulate_log(one_mass(), Drive(word="multisine", level=5.0), seconds=4.0, rate_hz=500.0)
    again = simulate_log(one_mass(), Drive(), recording=made.recorded.select(["/hammer.wrench.force.x"]))
    np.testing.assert_array_equal(again.recorded.values, made.recorded.values)
    assert again.recorded.start_time_ns == made.recorded.start_time_ns
    assert again.truth["excitation"] == {"kind": "log"}


def test_rate_and_length_follow_from_the_poles() -> None:
    run = default_run(one_mass().compile())
    # 10.07 Hz and a decay of 0.5 s: twenty and thirty times, rounded up to 1, 2 or 5.
    assert run == Run(seconds=20.0, sample_rate_hz=500.0)
    assert default_run(one_mass().compile(), seconds=3.0, rate_hz=700.0) == Run(seconds=3.0, sample_rate_hz=700.0)
    free = default_run(one_mass(stiffness=0.0).compile())
    assert free.samples <= 50_000


@pytest.mark.parametrize("word", ["random", "sweep", "multisine", "step", "impact"])
def test_every_word_gives_an_excitation_that_suits_the_run(word: str) -> None:
    run = Run(seconds=8.0, sample_rate_hz=256.0)
    x = excitation(word, run, level=3.0).samples(run.samples, run.sample_rate_hz, np.random.default_rng(0))
    assert x.shape == (2048,)
    size = np.sqrt(np.mean(x**2)) if word in ("random", "multisine") else np.abs(x).max()
    assert size == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: Drive(noise=-0.1), "must not be negative"),
        (lambda: Drive(level=float("nan")), "must be finite"),
        (lambda: Drive(seed=-1), "must not be negative"),
        (lambda: Run(seconds=0.0, sample_rate_hz=1.0), "seconds 0.0"),
        (lambda: excitation("drum", Run(seconds=1.0, sample_rate_hz=100.0), level=1.0), "none of random, sweep"),
        (lambda: excitation("step", Run(seconds=1.0, sample_rate_hz=100.0), level=1.0, band_hz=(1, 2)), "no meaning"),
        (lambda: simulate_log(one_mass(), Drive(input_name="hamer")), "no input 'hamer'; inputs: hammer"),
        (
            lambda: write_simulated_log(simulate_log(one_mass(), Drive(), seconds=1.0), Path("one.csv")),
            r"ends with \.mcap",
        ),
    ],
)
def test_impossible_requests_are_refused(wrong: object, words: str) -> None:
    with pytest.raises(SetupError, match=words):
        wrong()  # type: ignore[operator]  # each is a function


def test_a_model_without_inputs_has_nothing_to_drive() -> None:
    model = StructureModel(name="mute", structure=one_mass().structure, outputs=one_mass().outputs)
    with pytest.raises((SetupError, ModelError), match="no input"):
        simulate_log(model, Drive())
