"""Resonances narrower than a line: found without noise and with it, and none taken for one that isn't."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.modal.experimental.judged_lines import judged_lines
from chladni.modal.experimental.line_spacing import lines_for, longest_modal_segment_s, nothing_found
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.modal.experimental.significance import SignificanceRules, mode_significance
from chladni.signals.provenance import Provenance
from tests.modal import truth

IDENTIFY = PolyReferenceLeastSquares().identify
LINES_HZ = np.arange(0.0, 400.0)
# Five modes from 51.3 to 345.9 Hz, off the lines by 0.1 to 0.4 Hz.
FIRST_HZ = 51.3
FILE = Provenance(estimator="as in the file")


def functions(damping, *, noise=0.0, of_the_rms=False, seed=0, at=(0,)):
    """Accelerances as a file holds them: without std, coherence, or averages."""
    exact = truth.noisy_response(
        truth.chain(first_hz=FIRST_HZ, damping=damping), LINES_HZ, at, noise=0.0, rng=np.random.default_rng(0)
    )
    magnitude = np.abs(exact.values)
    level = np.sqrt(np.mean(magnitude**2, axis=-1, keepdims=True)) if of_the_rms else magnitude
    rng = np.random.default_rng(seed)
    scatter = rng.standard_normal(exact.values.shape) + 1j * rng.standard_normal(exact.values.shape)
    return replace(
        exact,
        values=exact.values + noise * level / np.sqrt(2) * scatter,
        std=np.full(exact.std.shape, np.inf),
        coherence=np.full(exact.coherence.shape, np.nan),
        provenance=FILE,
    )


@pytest.mark.parametrize("damping", [1e-3, 2e-4, 1e-5])
@pytest.mark.parametrize("at", [(0,), (0, 3)])
def test_without_noise_every_mode_is_exact(damping, at):
    modes, structure = IDENTIFY(functions(damping, at=at)), truth.chain(first_hz=FIRST_HZ, damping=damping)
    # To the rounding of functions whose peaks stand 10^5 above their valleys.
    np.testing.assert_allclose(modes.frequency_hz, structure.frequency_hz, rtol=1e-9)
    np.testing.assert_allclose(modes.damping_ratio, damping, rtol=1e-5)
    np.testing.assert_allclose(modes.shapes, structure.unit_shapes, atol=1e-6)


@pytest.mark.parametrize("of_the_rms", [False, True])
def test_one_percent_of_noise_hides_no_mode(of_the_rms):
    structure = truth.chain(first_hz=FIRST_HZ, damping=2e-4)
    for seed in range(4):
        modes = IDENTIFY(functions(2e-4, noise=0.01, of_the_rms=of_the_rms, seed=seed))
        np.testing.assert_allclose(modes.frequency_hz, structure.frequency_hz, rtol=1e-3)
        # Five sigma: the damping of a mode a fiftieth of a line wide is known badly, and known to be.
        assert np.all(np.abs(modes.frequency_hz - structure.frequency_hz) < 5 * modes.frequency_std_hz)
        assert np.all(np.abs(modes.damping_ratio - 2e-4) < 5 * modes.damping_std)


def test_the_lines_that_would_carry_the_damping_are_named():
    (note,) = [n for n in IDENTIFY(functions(1e-3)).provenance.notes if "lines wide at half power" in n]
    # The first mode is 2 x 0.001 x 51.3 = 0.1026 Hz wide, and two lines are asked for.
    assert note.endswith("few lines carry their damping; lines 0.052 Hz apart help, from records 19 times as long")
    wide = IDENTIFY(functions(0.03))
    assert not any("lines wide at half power" in n for n in wide.provenance.notes)


def test_a_line_that_stands_alone_is_no_resonance():
    # A hum at 200 Hz in all responses, a hundred times what the structure shows there.
    made = functions(0.01, noise=0.01)
    values = made.values.copy()
    values[..., 200] *= 100
    modes = IDENTIFY(replace(made, values=values))
    assert modes.frequency_hz.size == 5
    assert np.min(np.abs(modes.frequency_hz - 200.0)) > 20
    lines = judged_lines(replace(made, values=values), "accelerance", band_hz=None)
    on_top = np.append(truth.chain(first_hz=FIRST_HZ).poles, 2 * np.pi * (-0.01 + 200j))
    found = mode_significance(lines, on_top, np.ones((6, 1), complex))
    assert found.passes(SignificanceRules()).tolist() == [True] * 5 + [False]


def test_functions_that_are_noise_alone_hold_no_mode():
    made = functions(0.01)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(made.values.shape) + 1j * rng.standard_normal(made.values.shape)
        modes = IDENTIFY(replace(made, values=noise))
        assert modes.frequency_hz.size == 0
        (told,) = [note for note in modes.provenance.notes if note.startswith("no mode:")]
        # Nothing was averaged, and there is no coherence: neither is advised.
        assert "average longer" not in told
        assert "lines closer than these, 1 Hz apart" in told


def test_a_record_shows_modes_that_are_half_a_line_wide():
    # 0.2 % at 1 Hz in 800 s: lines of 0.01 Hz, on which the first mode is 0.4 lines wide.
    structure = truth.chain(damping=0.002)
    series = truth.record(structure, cycles=800, rng=np.random.default_rng(1), noise=0.01)
    modes = chladni.identify_modes(series, references=truth.FORCE.format(0))
    assert modes.frequency_hz.size == 5
    assert np.all(np.abs(modes.frequency_hz - structure.frequency_hz) < 5 * modes.frequency_std_hz)
    assert np.all(np.abs(modes.damping_ratio - 0.002) < 5 * modes.damping_std)


def test_a_resolution_that_hides_all_modes_is_told_with_the_one_that_shows_them():
    structure = truth.chain(damping=0.002)
    series = truth.record(structure, cycles=800, rng=np.random.default_rng(0), noise=0.01)
    blurred = chladni.identify_modes(series, references=truth.FORCE.format(0), resolution_hz=0.1)
    assert blurred.frequency_hz.size == 0
    (note,) = [note for note in blurred.provenance.notes if note.startswith("no mode is taken near")]
    asked_hz = float(note.split("ask for a resolution of ")[1].split(" Hz")[0])
    assert asked_hz < 0.1
    followed = chladni.identify_modes(series, references=truth.FORCE.format(0), resolution_hz=asked_hz)
    assert followed.frequency_hz.size == 5


def account(**given):
    made = functions(0.01)
    return replace(made, provenance=Provenance(**given))


# 401 half-overlapping segments of 1 s are 201 s.
AVERAGED = {"segment_s": 1.0, "averages": 401, "effective_averages": 300.0, "overlap": 0.5}


def test_lines_for_modes_leave_an_eighth_of_the_record_as_a_segment():
    """1 Hz lines up to 399 Hz; a resonance 0.1 Hz wide asks for lines 0.05 Hz apart."""
    long = account(**AVERAGED)
    assert longest_modal_segment_s(long) == pytest.approx(201 / 8)
    assert lines_for(long, 0.1) == "ask for a resolution of 0.05 Hz"
    assert lines_for(long, 0.01) == "ask for a resolution of 0.0399 Hz; a record 8 times as long helps further"
    broken = account(longest_s=4.0, **AVERAGED)
    assert lines_for(broken, 0.1) == "ask for a resolution of 0.25 Hz; a record 5 times as long helps further"
    period = account(averaging="periodic", **AVERAGED)
    assert longest_modal_segment_s(period) == 0
    assert lines_for(period, 0.1) == "a period 20 times as long helps"


def test_what_to_try_where_nothing_is_found():
    assert "ask for a resolution of 0.0399 Hz" in nothing_found(account(**AVERAGED))
    assert "look at a band where the coherence is better" in nothing_found(account(averaging="periodic", **AVERAGED))
    assert "lines closer than these, 1 Hz apart" in nothing_found(account())
