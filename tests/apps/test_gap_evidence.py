"""Spectra of the errors, and the stretch that tells most, against what is known of the signals."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.apps.gap_evidence import CYCLES, gap_evidence
from chladni.gap.records.diagnosis import Diagnosis, GapSignals
from tests import made_diagnosis as made

RATE_HZ, SAMPLES = 200.0, 4000
T = np.arange(SAMPLES) / RATE_HZ


def found_with(measured: object, before: object, after: object) -> Diagnosis:
    signals = replace(
        made.signals(),
        sample_rate_hz=RATE_HZ,
        output_names=("a",),
        output_units=("m/s^2",),
        measured=np.atleast_2d(measured),
        before=np.atleast_2d(before),
        after=np.atleast_2d(after),
        noise_rms=np.array([0.1]),
        # White up to the Nyquist frequency.
        noise_density=np.full((1, 33), 0.01 / (RATE_HZ / 2)),
    )
    assert isinstance(signals, GapSignals)
    return replace(made.diagnosis(), signals=signals)


def test_the_spectra_hold_the_power_of_the_errors() -> None:
    rng = np.random.default_rng(3)
    measured = rng.standard_normal(SAMPLES)
    evidence = gap_evidence(found_with(measured, 0.5 * measured, 0.9 * measured))
    assert evidence.spectra is not None
    spectra = evidence.spectra
    step = spectra.frequency_hz[1] - spectra.frequency_hz[0]
    for density, power in ((spectra.measured, 1.0), (spectra.before, 0.25), (spectra.after, 0.01)):
        # Mean square of 4000 samples of noise: its scatter is sqrt(2/4000), window and mean take some more.
        assert density[0].sum() * step == pytest.approx(power, rel=0.1)
    np.testing.assert_allclose(spectra.noise[0] * RATE_HZ / 2, 0.01)


def test_the_telling_stretch_is_where_the_model_errs() -> None:
    measured = np.sin(2 * np.pi * 10 * T)
    burst = np.where((T > 12) & (T < 13.2), 0.3, 0.0) * np.sin(2 * np.pi * 10 * T)
    telling_s = gap_evidence(found_with(measured, measured - burst, measured)).telling_s
    assert telling_s is not None
    start_s, end_s = telling_s
    assert start_s == pytest.approx(12, abs=0.15)
    # Twelve cycles of 10 Hz; lines lie half a hertz apart.
    assert end_s - start_s == pytest.approx(CYCLES / 10, rel=0.1)


def test_a_log_too_short_for_spectra_is_shown_whole() -> None:
    values = np.linspace(0.0, 1.0, 7)
    evidence = gap_evidence(found_with(values, 0 * values, values))
    assert evidence.telling_s == (0.0, 7 / RATE_HZ)


def test_no_gap_and_no_signals_are_fine() -> None:
    same = np.sin(2 * np.pi * 20 * T)
    assert gap_evidence(found_with(same, same, same)).telling_s is not None
    silent = gap_evidence(found_with(0 * T, 0 * T, 0 * T))
    assert silent.telling_s is not None
    bare = gap_evidence(replace(made.diagnosis(), signals=None))
    assert (bare.spectra, bare.telling_s) == (None, None)


def test_a_model_that_diverges_is_drawn_as_far_as_it_goes() -> None:
    measured = np.sin(2 * np.pi * 10 * T)
    before = np.where(T > 15, np.nan, 0.9 * measured)
    before[2500] = np.inf
    evidence = gap_evidence(found_with(measured, before, measured))
    assert evidence.spectra is not None
    assert np.isfinite(evidence.spectra.before).all()
    assert evidence.telling_s is not None
    assert evidence.telling_s[0] < 15


def test_jumps_between_windows_dont_leak_into_the_spectra_of_errors() -> None:
    signals, length = made.signals(), 500
    samples = signals.measured.shape[1]
    # An error that grows by the square of the time in each window, from nothing.
    growing = (np.arange(samples) % length / length) ** 2
    drifted = replace(signals, before=signals.measured - growing)
    starts = tuple(range(0, samples, length))
    joined, apart = (
        gap_evidence(replace(made.drifting(), signals=replace(drifted, window_starts=one))).spectra
        for one in ((), starts)
    )
    assert joined is not None
    assert apart is not None
    # Far above the error's own frequencies only the jumps have power.
    high = [one.before[:, one.frequency_hz > 50].max() for one in (joined, apart)]
    assert high[1] < 1e-3 * high[0]
