import numpy as np
import pytest

from chladni.io.files.csv import write_csv
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ, HEIGHT, PULSE_S = 5000.0, 500.0, 0.011


@pytest.fixture(scope="module")
def drop(tmp_path_factory):
    """A half sine of 11 ms on gravity, and the force that made it."""
    t = np.arange(2000) / RATE_HZ - 0.1
    pulse = np.where((t > 0) & (t < PULSE_S), np.sin(np.pi * t / PULSE_S), 0.0)
    channels = (Channel(name="table", unit="m/s^2"), Channel(name="cell", unit="N"))
    path = tmp_path_factory.mktemp("drop") / "drop.csv"
    write_csv(
        TimeSeries(values=np.stack([9.81 + HEIGHT * pulse, pulse]), sample_rate_hz=RATE_HZ, channels=channels), path
    )
    return path


def test_accelerations_are_taken_and_gravity_is_taken_off(run, drop):
    document = run("srs", drop, "--q", 1000, "--json", "-").document
    assert (document["format"], document["q"]) == ("chladni.srs/1", 1000.0)
    (table,) = document["channels"]
    assert (table["name"], table["unit"], table["offset"]) == ("table", "m/s^2", pytest.approx(9.81))
    assert len(table["maximax"]) == len(document["frequency_hz"])
    highest = int(np.argmax(table["maximax"]))
    # Undamped: 1.77 times the pulse where it lasts 0.8 periods (Harris' Shock and Vibration Handbook, ch. 8).
    assert table["maximax"][highest] / HEIGHT == pytest.approx(1.77, rel=0.01)
    assert document["frequency_hz"][highest] * PULSE_S == pytest.approx(0.81, rel=0.05)


def test_people_get_a_table_and_a_picture(run, drop, tmp_path):
    outcome = run(
        "srs", drop, "--quantity", "pseudo-velocity", "--band", 10, 500, "--lines", 6, "--figures", tmp_path
    )
    assert outcome.code == 0, outcome.err
    assert "Shock response, pseudo velocity, Q = 10, from 11.05 to 500 Hz" in outcome.out
    assert "m/s " in outcome.out
    assert list(tmp_path.glob("srs-1-*.png"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--channel", "cell"), "cell is in N; a shock response spectrum is of accelerations"),
        (("--q", "0.2"), "drop.csv: q is 0.2"),
        (("--band", "100", "20"), "give the lower end first"),
        (("--band", "100", "2e4"), "half the sample rate, 2500 Hz"),
        (("--lines", "0"), "lines an octave"),
        (("--start", "7"), "no sample"),
    ],
)
def test_bad_options_are_told_in_one_line(run, drop, options, words):
    refused = run("srs", drop, *options)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert words in refused.err


def test_a_log_without_accelerations_says_what_there_is_and_the_remedy_works(run, tmp_path):
    np.savetxt(tmp_path / "a.csv", np.random.default_rng(1).standard_normal(500), header="a", comments="")
    refused = run("srs", tmp_path / "a.csv", "--rate", 1000)
    assert refused.code == 2
    assert "no channel is an acceleration; units are 1: name a channel (--channel)" in refused.err
    assert run("srs", tmp_path / "a.csv", "--rate", 1000, "--channel", "a").code == 0
    (tmp_path / "setup.toml").write_text('format = "chladni.setup/1"\n[[channel]]\npath = "a"\nunit = "g"\n')
    assert run("srs", tmp_path / "a.csv", "--rate", 1000, "--setup", tmp_path / "setup.toml").code == 0
