"""Which hold drove a machine is told from its log, and never told wrongly."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import chirp

from chladni import open_log
from chladni.gap.comparison.measuring import measurement_of
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.diagnosis.told_holds import with_told_holds
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import attached
from chladni.models.files.model_file import load_model
from chladni.models.integrator.integrator import Integrator
from tests.gap.made_log import RATE_HZ, three_bodies

SAMPLES, BEFORE, FINER = 4000, 500, 32
EXCITATIONS = ("multisine", "low-passed", "sweep")
HOLDS = ("zoh", "foh", "band_limited")
#: What drives an input whose hold nobody has told. Where that leaves noise alone nothing else is asked about.
DEFAULT = "foh"


def fine_signal(kind, rng):
    """``[instant]`` of a signal that has nothing above 0.45 of the rate, on a grid that is `FINER` than the log's."""
    count = SAMPLES + BEFORE
    if kind == "sweep":
        times = np.arange(count * FINER) / (RATE_HZ * FINER)
        return chirp(times, 2.0, times[-1], rng.uniform(0.2, 0.4) * RATE_HZ, phi=rng.uniform(0, 360))
    cycles = np.fft.rfftfreq(count)
    if kind == "multisine":
        size = (cycles > 0) & (cycles < rng.uniform(0.2, 0.4))
        lines = size * np.exp(2j * np.pi * rng.uniform(size=cycles.size))
    else:
        size = (cycles < 0.45) / np.sqrt(1 + (cycles / rng.uniform(0.1, 0.25)) ** 8)
        lines = size * (rng.standard_normal(cycles.size) + 1j * rng.standard_normal(cycles.size))
    lines[0] = 0.0
    whole = np.zeros(count * FINER // 2 + 1, dtype=complex)
    whole[: lines.size] = lines
    return np.fft.irfft(whole, count * FINER)


def between(fine, hold):
    """What drives the machine, of a signal whose samples are logged."""
    samples = fine[::FINER]
    if hold == "zoh":
        return np.repeat(samples, FINER)
    if hold == "foh":
        return np.interp(np.arange(fine.size) / FINER, np.arange(samples.size), samples)
    return fine


def made(hold, kind, noise, seed, *, effects=()):
    """A machine that is off its nominal values by up to one tolerance, followed between its samples, in motion."""
    rng = np.random.default_rng([seed, 7])
    nominal = three_bodies()
    tunables = Tunables.of(nominal)
    machine = nominal.with_values(tunables.values(rng.uniform(-1, 1, len(tunables.names)))).with_effects(effects)
    fine = 100.0 * fine_signal(kind, rng)
    found = Integrator(machine.compile(), RATE_HZ * FINER).run(between(fine, hold)[None]).outputs
    outputs = found[:, BEFORE * FINER :: FINER]
    outputs = outputs + noise * outputs.std(axis=1, keepdims=True) * rng.standard_normal(outputs.shape)
    log = Measurement(
        log="made", sample_rate_hz=RATE_HZ, inputs=fine[None, BEFORE * FINER :: FINER], outputs=outputs,
        input_names=("hammer",), output_names=("a0", "a1", "a2"), output_units=("m/s^2",) * 3,
    )  # fmt: skip
    return nominal, log, tunables


def told(nominal, log, tunables):
    """What the only input is told to do between its samples, None where the log doesn't tell."""
    found = with_told_holds(nominal, locate(nominal, log, estimate_noise(log), tunables))
    return found.compile().inputs[0].hold


# Every hold with every excitation, twenty times each, is a matter of the night.
@pytest.mark.parametrize(
    ("hold", "kind"),
    [
        pytest.param("zoh", "multisine", marks=pytest.mark.nightly),
        ("foh", "low-passed"),
        pytest.param("band_limited", "sweep", marks=pytest.mark.nightly),
    ],
)
def test_the_hold_of_a_machine_with_nothing_missing(hold, kind):
    """What drives the machine is what drove it: told from the log, or as it is by default."""
    assert (told(*made(hold, kind, 0.01, 1)) or DEFAULT) == hold


def test_straight_lines_are_what_drives_an_input_whose_hold_nobody_has_told():
    assert three_bodies().compile().holds == (DEFAULT,)


@pytest.mark.nightly
@pytest.mark.parametrize("noise", [0.003, 0.01])
@pytest.mark.parametrize("kind", EXCITATIONS)
@pytest.mark.parametrize("hold", HOLDS)
def test_twenty_machines_of_each_kind(hold, kind, noise):
    answers = [told(*made(hold, kind, noise, seed)) for seed in range(100, 120)]
    assert set(answers) <= {hold, None}
    assert [one or DEFAULT for one in answers].count(hold) >= 19


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))])
@pytest.mark.parametrize("hold", ["zoh", *(pytest.param(hold, marks=pytest.mark.nightly) for hold in HOLDS[1:])])
@pytest.mark.parametrize(
    "effect",
    [
        pytest.param(("added_mass", "b1", {"mass": 0.8}), marks=pytest.mark.nightly),
        pytest.param(("hardening_stiffness", "j1", {"cubic": 3e12}), marks=pytest.mark.nightly),
        pytest.param(("coulomb_friction", "j1", {"force": 20.0}), marks=pytest.mark.nightly),
        # Not by half a sample, which another hold does as well.
        pytest.param(("delay", "hammer", {"delay": 3.0 / RATE_HZ}), marks=pytest.mark.nightly),
    ],
    ids=lambda effect: effect[0],
)
def test_what_is_missing_is_no_hold(effect, hold, seed):
    """Beside an effect a hold is told rightly, or not at all."""
    found = told(*made(hold, "low-passed", 0.01, seed, effects=[attached(*effect)]))
    assert found in {hold, None}


def test_a_wrong_hold_does_not_hide_where_the_cause_is():
    """Half a sample leaves more than a sensor's gain, and elsewhere: the place is looked for with each hold."""
    gain = attached("gain_error", "a1", {"gain": 0.9})
    assert told(*made("zoh", "low-passed", 0.01, 0, effects=[gain])) == "zoh"


@pytest.mark.nightly
def test_a_hold_that_the_model_states_is_not_asked_about():
    nominal, log, tunables = made("zoh", "multisine", 0.01, 1)
    stated = nominal.with_holds({"hammer": "foh"})
    assert told(stated, log, tunables) == "foh"


@pytest.mark.nightly
def test_a_smooth_log_of_a_machine_with_nothing_missing(shared_data: Path):
    folder = shared_data / "diagnosis" / "p2_none_smooth_1pct"
    if not folder.is_dir():
        pytest.skip("the smooth log isn't there")
    model = load_model(folder / "model.toml")
    log, _ = measurement_of(model, open_log(folder / "log.mcap").read(), log="smooth")
    found = told(model, log, Tunables.of(model))
    assert found == "band_limited"
