"""Advice of ``psd``, ``frf`` and ``modes`` is taken at its word: what it asks for is done, and works."""

import re

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.modal import truth
from tests.spectral.test_impact import FIVE, hammer_log, pulses

ASKED = re.compile(r"[Aa]sk for (?:a resolution of )?([0-9.e+-]+) Hz")
# What can't be had by an option is asked of the next measurement.
MEASURE = re.compile(r"record.*times as long|records of .* s help|measure longer|average longer|take more hits")
FORCE = truth.FORCE.format(0)


def joined(outcome):
    return " ".join((outcome.out + " " + outcome.err).split())


def follow(run, command, log, *options, rounds=6):
    """Run a command, do what it asks for until it asks for nothing more; give what it asked for, in order."""
    asked, given = [], []
    for _ in range(rounds):
        outcome = run(command, log, *options, *given)
        told = joined(outcome)
        assert not asked or outcome.code == 0, told
        wanted = [float(number) for number in ASKED.findall(told)]
        if not wanted:
            return asked, outcome
        assert wanted[0] not in asked, f"asked for {wanted[0]} Hz again: {told}"
        asked.append(wanted[0])
        given = ["--resolution", f"{wanted[0]:.12g}"]
    return asked, outcome


@pytest.fixture(scope="module")
def hits(tmp_path_factory):
    """Five hits 2 s apart on a mass with 0.1 % of damping, whose resonance is a third of a line wide in 2 s."""
    path = tmp_path_factory.mktemp("hits") / "hits.mcap"
    log = hammer_log(pulses(10, FIVE), damping=0.001)
    channels = (Channel(name="/daq.force", unit="N"), Channel(name="/daq.plate", unit="m/s^2"))
    write_mcap([TimeSeries(values=log.values, sample_rate_hz=log.sample_rate_hz, channels=channels)], path)
    return path


@pytest.fixture(scope="module")
def narrow(tmp_path_factory):
    """Random excitation of a chain whose modes of 0.2 % need some hundred seconds a segment."""
    path = tmp_path_factory.mktemp("narrow") / "chain.mcap"
    series = truth.record(truth.chain(damping=0.002), cycles=800, rng=np.random.default_rng(0), noise=0.01)
    names = ["/daq.force", *(f"/daq.mass{mass}" for mass in range(5))]
    channels = tuple(channel.with_name(name) for channel, name in zip(series.channels, names, strict=True))
    write_mcap([series.with_channels(channels)], path)
    return path


def tone_log(path, frequency_hz, *, seconds=5.0, gap_s=None):
    time_s = np.arange(round(seconds * 400)) / 400
    values = np.sin(2 * np.pi * frequency_hz * time_s) + 0.01 * np.random.default_rng(1).standard_normal(time_s.size)
    valid = None
    if gap_s is not None:
        valid = np.ones((1, time_s.size), bool)
        # At random, as far apart at most: even losses are what a clock makes that ticks a little too fast.
        apart = np.random.default_rng(2).integers(round(200 * gap_s), round(400 * gap_s) + 1, time_s.size)
        valid[0, np.cumsum(apart[np.cumsum(apart) < time_s.size])] = False
    channels = (Channel(name="/imu.linear_acceleration.x", unit="m/s^2"),)
    write_mcap([TimeSeries(values=values[None], sample_rate_hz=400.0, channels=channels, valid=valid)], path)
    return path


def test_records_between_hits_are_as_long_as_they_can_be_and_longer_ones_are_asked_of_the_next_test(run, hits):
    asked, outcome = follow(run, "frf", hits, "--reference", "/daq.force")
    assert asked == []
    assert re.search(r"records of [0-9.]+ s help: hit at longer intervals", joined(outcome))


def test_a_resolution_that_hits_have_no_room_for_is_refused_with_the_finest_that_they_have(run, hits):
    refused = run("frf", hits, "--reference", "/daq.force", "--resolution", 0.4)
    assert refused.code == 2
    assert refused.err.count("\n") == 1
    (finest,) = ASKED.findall(joined(refused))
    followed = run("frf", hits, "--reference", "/daq.force", "--resolution", finest)
    assert followed.code == 0, followed.err
    assert "5 hits of" in followed.out


def test_coarse_records_of_hits_ask_for_the_finest(run, hits):
    asked, outcome = follow(run, "frf", hits, "--reference", "/daq.force", "--resolution", 5)
    # The records are two seconds apart at the most.
    assert asked
    assert asked[-1] == pytest.approx(0.52, abs=0.03)
    assert MEASURE.search(joined(outcome))


def test_modes_beyond_the_force_of_a_hammer_are_looked_for_in_a_band(run, hits):
    told = joined(run("modes", hits, "--reference", "/daq.force"))
    end_hz = float(re.search(r"20 dB down above ([0-9.]+) Hz: .*give a band", told).group(1))
    assert run("modes", hits, "--reference", "/daq.force", "--band", 100, 1.2 * end_hz).code == 0


def test_a_short_record_of_a_slow_tone_asks_for_the_lines_that_show_it(run, tmp_path):
    asked, outcome = follow(run, "psd", tone_log(tmp_path / "slow.mcap", 6.0))
    assert len(asked) == 1
    assert re.search(r"/imu.linear_acceleration.x +6\.\d", outcome.out)
    untold = run("psd", tone_log(tmp_path / "fast.mcap", 20.0))
    assert "20.0" in untold.out
    assert "above 9.375 Hz" in untold.out


def test_a_record_in_pieces_asks_for_no_longer_segments_than_its_pieces(run, tmp_path):
    path = tone_log(tmp_path / "pieces.mcap", 2.0, seconds=60.0, gap_s=1.5)
    refused = run("psd", path, "--resolution", 0.1)
    assert refused.code == 2
    (coarser,) = ASKED.findall(joined(refused))
    assert float(coarser) >= 1 / 1.5
    assert run("psd", path, "--resolution", coarser).code == 0
    asked, _ = follow(run, "psd", path)
    assert all(resolution_hz >= 1 / 1.5 for resolution_hz in asked)


def test_a_resolution_longer_than_the_record_is_refused_with_one_that_fits(run, tmp_path):
    path = tone_log(tmp_path / "short.mcap", 20.0, seconds=5.3)
    refused = run("psd", path, "--resolution", 0.1)
    assert refused.code == 2
    (coarser,) = ASKED.findall(joined(refused))
    assert run("psd", path, "--resolution", coarser).code == 0


def test_peaks_narrower_than_the_lines_are_followed_as_far_as_the_record_goes(run, narrow):
    asked, outcome = follow(run, "frf", narrow, "--reference", "/daq.force")
    assert asked == sorted(asked, reverse=True)
    # A quarter of 800 s is the longest segment: from there on a longer record is asked for.
    assert asked[-1] >= 1 / 200
    assert MEASURE.search(joined(outcome)) or "half power" not in joined(outcome)


def test_modes_hidden_by_coarse_lines_are_found_on_those_that_are_asked_for(run, narrow):
    options = ["--reference", "/daq.force"]
    hidden = run("modes", narrow, *options, "--resolution", 0.1)
    assert "No mode was found" in hidden.out
    (finer, *_) = ASKED.findall(joined(hidden))
    document = run("modes", narrow, *options, "--resolution", finer, "--json", "-").document
    found = [mode["frequency_hz"] for mode in document["modes"]]
    assert found == pytest.approx(truth.chain().frequency_hz, rel=1e-3)
    # Nor does a next look at once ask for more than the record holds.
    told = " ".join(document["notes"])
    assert MEASURE.search(told) or not ASKED.search(told)


def test_a_window_on_whole_periods_is_left_out_when_told_to(run, tmp_path):
    random = np.random.default_rng(1)
    force = np.tile(random.standard_normal(1024), 12)
    values = np.stack([force, np.convolve(force, [0.5, 0.3, 0.1])[: force.size]])
    channels = (Channel(name="/daq.force", unit="N"), Channel(name="/daq.a", unit="m/s^2"))
    path = tmp_path / "periods.mcap"
    write_mcap([TimeSeries(values=values, sample_rate_hz=512.0, channels=channels)], path)
    told = joined(run("frf", path, "--reference", "/daq.force", "--window", "hann"))
    assert "leave window, resolution and overlap out to average whole periods" in told
    assert "whole periods of" in joined(run("frf", path, "--reference", "/daq.force"))


def test_a_log_without_excitation_is_told_what_to_ask_for(run, tmp_path):
    path = tone_log(tmp_path / "alone.mcap", 20.0, seconds=60.0)
    refused = run("modes", path)
    assert refused.code == 2
    assert "operational" in refused.err
    assert run("modes", path, "--operational").code == 0
