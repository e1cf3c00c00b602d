"""Averages that ran while a log grew are those of the finished file; what changes in it is told."""

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.apps.frf import frf
from chladni.apps.live import live
from chladni.apps.live_document import EventBook, live_document, live_study
from chladni.apps.modes import identify_modes
from chladni.apps.psd import psd
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.live_state import LiveState
from chladni.signals.time_series import TimeSeries
from chladni.spectral.coherence import coherence
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.levels import levels
from chladni.spectral.severity import severity
from chladni.spectral.waterfall import waterfall
from tests.io.live.growing import Bits
from tests.modal.truth import chain

RATE_HZ, SECONDS, RESOLUTION_HZ = 200.0, 120, 0.5
FORCE = "/shaker.wrench.force.z"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A chain of five masses, shaken by noise, with half a second lost."""
    samples = int(SECONDS * RATE_HZ)
    force = 10 * np.random.default_rng(0).standard_normal((1, samples))
    motion = chain(first_hz=8.0, damping=0.02).respond(force, [4], RATE_HZ)
    motion += 0.01 * motion.std() * np.random.default_rng(1).standard_normal(motion.shape)
    valid = np.ones((1, samples), bool)
    valid[:, 5000:5100] = False
    channels = [(Channel(name=FORCE, unit="N", role="reference"), force[0])]
    channels += [
        (Channel(name=f"/mass{number}.accel.linear.z", unit="m/s^2"), row) for number, row in enumerate(motion)
    ]
    parts = [
        TimeSeries(
            values=np.where(valid, row, np.nan), valid=valid, sample_rate_hz=RATE_HZ, channels=(channel,),
            start_time_ns=1_700_000_000_000_000_000,
        )
        for channel, row in channels
    ]  # fmt: skip
    path = tmp_path_factory.mktemp("live") / "chain.mcap"
    write_mcap(parts, path)
    return path


@pytest.fixture(scope="module")
def last(log: Path) -> LiveState:
    """The last state of the log, read in pieces of odd sizes."""
    *_, state = live(Bits(log.read_bytes(), (10_007, 1, 333)), resolution_hz=RESOLUTION_HZ)
    return state


def assert_same(one: np.ndarray, other: np.ndarray) -> None:
    """To 1e-12 of the largest."""
    np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * float(np.nanmax(np.abs(other))))


def test_densities_are_those_of_the_finished_file(log: Path, last: LiveState) -> None:
    assert last.ended
    reference = psd(log, resolution_hz=RESOLUTION_HZ)
    assert_same(last.densities[0].values, reference.values)
    assert_same(last.densities[0].frequency_hz, reference.frequency_hz)
    assert last.densities[0].provenance.averages == reference.provenance.averages


def test_exponential_averages_and_peak_hold_are_those_of_the_finished_file(log: Path, last: LiveState) -> None:
    with open_log(log) as opened:
        series = opened.read()
    exponential = cross_spectra(series, resolution_hz=RESOLUTION_HZ, averaging="exponential", time_constant_s=10.0)
    held = cross_spectra(series, resolution_hz=RESOLUTION_HZ, averaging="peak-hold")
    assert_same(last.exponential[0].values, np.einsum("iif->if", exponential.density).real)
    assert_same(last.peak_hold[0].values, np.einsum("iif->if", held.density).real)


def test_frequency_responses_coherence_and_modes_are_those_of_the_finished_file(log: Path, last: LiveState) -> None:
    spectra = cross_spectra(log, resolution_hz=RESOLUTION_HZ)
    assert last.response is not None
    assert last.coherence is not None
    assert last.modes is not None
    assert_same(last.response.values, frf(log, references=FORCE, resolution_hz=RESOLUTION_HZ).values)
    assert_same(last.coherence.values, coherence(spectra, references=FORCE).values)
    modes = identify_modes(spectra.select([channel.name for channel in last.modes.channels]))
    assert_same(last.modes.frequency_hz, modes.frequency_hz)
    assert_same(last.modes.damping_ratio, modes.damping_ratio)
    assert_same(last.modes.shapes, modes.shapes)
    assert modes.frequency_hz.size >= 3


def test_waterfall_levels_and_severity_are_those_of_the_finished_file(log: Path, last: LiveState) -> None:
    with open_log(log) as opened:
        series = opened.read()
    assert_same(last.waterfalls[0].values, waterfall(series, resolution_hz=RESOLUTION_HZ).values)
    assert_same(last.levels[0].rms, levels(series).rms)
    assert_same(last.levels[0].kurtosis, levels(series).kurtosis)
    assert_same(last.severities[0].velocity_mm_s, severity(series).velocity_mm_s)


def test_modes_of_the_present_are_followed_by_their_numbers(last: LiveState) -> None:
    truth_hz = chain(first_hz=8.0).frequency_hz
    assert len(last.tracked) >= 3
    for mode in last.tracked:
        assert np.abs(truth_hz - mode.frequency_hz).min() < 0.05 * mode.frequency_hz


@pytest.mark.nightly
def test_the_gap_is_told_with_its_time(log: Path) -> None:
    events = [event for state in live(Bits(log.read_bytes()), modes_every_s=0) for event in state.events]
    gaps = [event for event in events if event.kind == "gap"]
    assert len(gaps) == 6
    assert {event.samples for event in gaps} == {100}
    assert all(event.time_s == pytest.approx(25.5, abs=0.01) for event in gaps)


def test_it_ends_when_asked_to_with_all_that_came(log: Path) -> None:
    stop, states = threading.Event(), []
    for state in live(Bits(log.read_bytes(), (200_000,)), resolution_hz=RESOLUTION_HZ, stop=stop):
        states.append(state)
        if state.time_s > 20:
            stop.set()
    assert states[-1].ended
    assert 20 < states[-1].time_s < SECONDS
    assert states[-1].densities


def test_the_document_and_the_study_hold_what_was_found(last: LiveState) -> None:
    document = live_document(last, EventBook())
    assert document["format"] == "chladni.live/1"
    assert document["duration_s"] == pytest.approx(SECONDS)
    assert len(document["psd"]["channels"]) == 6
    study = live_study(last, ["first"])
    assert study.findings == ("first",)
    assert study.peaks


def test_a_reference_that_no_channel_is_is_told(log: Path) -> None:
    states = list(live(Bits(log.read_bytes(), (1 << 20,)), references=["/shaker.wrench.torque.z"], modes_every_s=0))
    told = [event.text for state in states for event in state.events if event.kind == "note"]
    assert told == [
        f"no frequency response to /shaker.wrench.torque.z yet: no channel is named so; did you mean {FORCE}?"
    ]
    assert states[-1].response is None


def test_channels_that_never_change_are_left_out_of_pictures_and_named(tmp_path: Path) -> None:
    force, answer = np.random.default_rng(0).standard_normal((2, 3000))
    # Equal values have a mean that may differ from them by rounding.
    rows = {FORCE: force, "/imu.x": answer, "/imu.y": np.zeros(3000), "/imu.z": np.full(3000, 0.1)}
    channels = [Channel(name=name, unit="N" if name == FORCE else "m/s^2") for name in rows]
    series = TimeSeries(values=np.stack(list(rows.values())), sample_rate_hz=100.0, channels=tuple(channels))
    write_mcap([series], tmp_path / "imu.mcap")
    *_, state = live(Bits((tmp_path / "imu.mcap").read_bytes()), references=FORCE, modes_every_s=0)
    assert state.still == ("/imu.y", "/imu.z")
    assert len(live_document(state, EventBook())["levels"]["channels"]) == 4
    study = live_study(state, ["first"])
    assert study.findings == ("first", "channels that never change are left out: /imu.y, /imu.z")
    for parts in (study.densities, study.levels, study.waterfalls):
        assert [channel.name for part in parts for channel in part.channels] == [FORCE, "/imu.x"]
    assert [channel.name for part in study.severities for channel in part.channels] == ["/imu.x"]
    assert study.response is not None
    assert [channel.name for channel in study.response.responses] == ["/imu.x"]
    at_rest = replace(state, still=tuple(rows))
    assert [len(one.channels) for one in live_study(at_rest).densities] == [4]
