"""``chladni tolerance`` and ``chladni zoom`` on noise of a known density, with a tone in it."""

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ, SAMPLES, G = 1000.0, 60_000, 9.80665
# White noise of 0.01 g^2/Hz up to half the sample rate, 10 to 400 Hz of it asked for.
DENSITY = 0.01
PROFILE = ("10:0.01", "400:0.01")


@pytest.fixture(scope="module")
def shaken(tmp_path_factory):
    """A control channel that keeps the profile, and one with a tone of 3 g at 123.4 Hz."""
    noise = np.random.default_rng(1).standard_normal((2, SAMPLES)) * G * np.sqrt(DENSITY * RATE_HZ / 2)
    noise[1] += 3 * G * np.sin(2 * np.pi * 123.4 * np.arange(SAMPLES) / RATE_HZ)
    path = tmp_path_factory.mktemp("shaken") / "shaken.mcap"
    channels = (Channel(name="/daq.control", unit="m/s^2"), Channel(name="/daq.item", unit="m/s^2"))
    write_mcap([TimeSeries(values=noise, sample_rate_hz=RATE_HZ, channels=channels)], path, layout="batches")
    return path


def test_a_profile_is_kept_or_not(run, shaken, tmp_path):
    outcome = run("tolerance", shaken, *PROFILE, "--resolution", 4, "--json", "-", "--figures", tmp_path)
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["unit"]) == ("chladni.tolerance/1", "m/s^2")
    assert document["profile_rms"] == pytest.approx(G * np.sqrt(DENSITY * 390))
    control, item = document["channels"]
    assert control["outside"] == 0.0
    # RMS of Gaussian noise scatters by 1/(2 sqrt(BT)).
    assert control["rms"] == pytest.approx(document["profile_rms"], rel=4 / (2 * np.sqrt(390 * 60)) + 0.005)
    assert 0 < item["outside"] < 0.05
    high = int(np.argmax(item["deviation_db"]))
    assert item["frequency_hz"][high] == pytest.approx(123.4, abs=2)
    assert (tmp_path / "tolerance-1-acceleration.png").exists()
    told = run("tolerance", shaken, *PROFILE, "--resolution", 4).out
    assert "Profile of 1.975 g RMS, +3 -3 dB" in told


def test_a_tone_is_read_between_lines(run, shaken, tmp_path):
    outcome = run("zoom", shaken, "--band", 122, 125, "--channel", "/daq.item", "--json", "-", "--figures", tmp_path)
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert document["format"] == "chladni.zoom/1"
    (item,) = document["channels"]
    highest = int(np.argmax(item["amplitude"]))
    assert document["frequency_hz"][highest] == pytest.approx(123.4, abs=0.003)
    assert item["amplitude"][highest] == pytest.approx(3 * G, rel=0.02)
    assert (tmp_path / "zoom-1-amplitudes-acceleration.png").exists()
    assert "123.4" in run("zoom", shaken, "--band", 122, 125).out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("tolerance", "10=0.01", "400:0.01"), "breakpoint '10=0.01' is not of the form HZ:DENSITY"),
        (("tolerance", "10:0.01"), "two breakpoints or more"),
        (("tolerance", *PROFILE, "--unit", "N"), "no channel is in N, as the profile is; units are m/s^2"),
        (("tolerance", *PROFILE, "--upper", -1), "both must be 0 or more"),
        (("zoom", "--band", 300, 100), "--band: a band from 300 to 100 Hz"),
        (("zoom", "--band", 100, 300, "--lines", 1), "1 line; give 2 to"),
        (("zoom", "--band", 100, 300, "--window", "hand"), "hand"),
    ],
)
def test_bad_options_are_told_in_one_line(run, shaken, arguments, words):
    refused = run(arguments[0], shaken, *arguments[1:])
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert words in refused.err


def test_what_the_spectrum_does_not_reach_of_a_profile_is_told(run, shaken):
    outcome = run("tolerance", shaken, "10:0.01", "2000:0.01", "--resolution", 4)
    assert outcome.code == 0, outcome.err
    assert "the profile ends at 2000 Hz, the spectrum at 500 Hz; what lies between is not judged" in outcome.out
    assert "is not judged" not in run("tolerance", shaken, *PROFILE, "--resolution", 4).out


def test_breakpoints_out_of_order_are_named(run, shaken):
    outcome = run("tolerance", shaken, "80:0.1", "20:0.1")
    assert outcome.code == 2
    assert "breakpoint 20 Hz follows 80 Hz; give them in rising order" in outcome.err
