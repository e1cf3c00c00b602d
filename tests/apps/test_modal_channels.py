"""Which channels modes are identified from, without being told."""

import numpy as np
import pytest

from chladni.apps.excitation import excitation_names
from chladni.apps.frf import frf
from chladni.apps.modal_channels import motions_of_one_unit, responses_alone
from chladni.apps.modes import identify_modes
from chladni.apps.sources import Span, no_progress
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries

SAMPLES = 400


def noise(*channels, rate_hz=100.0, still=()):
    values = np.random.default_rng(1).standard_normal((len(channels), SAMPLES))
    for name in still:
        values[[channel.name for channel in channels].index(name)] = 3.0
    return TimeSeries(values=values, channels=channels, sample_rate_hz=rate_hz)


def acceleration(name):
    return Channel(name=name, unit="m/s^2")


HAMMER = Channel(name="hammer", unit="N", role="reference")
SHAKER = Channel(name="shaker", unit="N", role="reference")
ONE, TWO = acceleration("one"), acceleration("two")
GYRO = Channel(name="gyro", unit="rad/s")


def test_marked_references_that_change_are_the_excitations():
    series = noise(HAMMER, ONE, SHAKER, still=["hammer"])
    assert excitation_names(series, Span()) == ("shaker",)


def test_without_marks_the_first_force_that_changes_is_the_excitation():
    first, second = Channel(name="first", unit="N"), Channel(name="second", unit="N")
    assert excitation_names(noise(ONE, first, second), Span()) == ("first",)
    assert excitation_names(noise(ONE, first, second, still=["first"]), Span()) == ("second",)


@pytest.mark.parametrize("series", [noise(ONE, TWO), noise(ONE, HAMMER, still=["hammer"])])
def test_no_excitation_is_told_with_both_remedies(series):
    with pytest.raises(EstimateError, match=r"name it as reference \(--reference\).*responses alone.*there are one"):
        identify_modes(series)
    with pytest.raises(EstimateError, match=r"name it as reference \(--reference\); there are one"):
        frf(series)


def test_motions_of_the_most_common_unit_are_chosen_and_the_others_named():
    names, notes = motions_of_one_unit([GYRO, ONE, TWO], named=False)
    assert names == ("one", "two")
    assert "gyro" in notes[0]


def test_a_motion_goes_before_more_channels_of_no_motion():
    volts = [Channel(name=f"v{number}", unit="V") for number in range(3)]
    assert motions_of_one_unit([*volts, ONE], named=False)[0] == ("one",)


def test_named_channels_of_several_units_are_refused():
    with pytest.raises(EstimateError, match="responses of one unit"):
        motions_of_one_unit([GYRO, ONE], named=True)


def test_responses_of_a_series_leave_out_forces_and_what_stands_still():
    samples, notes = responses_alone(
        noise(HAMMER, ONE, TWO, GYRO, still=["two"]), None, Span(end_s=2.0), progress=no_progress
    )
    assert isinstance(samples, TimeSeries)
    # One gyroscope beside one accelerometer: an acceleration and a rotation are both motions, the first one wins.
    assert [channel.name for channel in samples.channels] == ["one"]
    assert samples.samples == 200
    assert "gyro" in notes[0]
    assert notes[1] == "channels that never change are left out: two"


def test_a_series_without_response_is_refused():
    with pytest.raises(EstimateError, match="no response that changes"):
        responses_alone(noise(HAMMER), None, Span(), progress=no_progress)


@pytest.fixture
def log(tmp_path):
    slow = [acceleration("/slow/a.accel.linear.x")]
    fast = [acceleration(f"/fast/{name}.accel.linear.x") for name in "abc"]
    series = [noise(channel, rate_hz=50.0) for channel in slow]
    series += [noise(channel, still=[channel.name] if "/c" in channel.name else ()) for channel in fast]
    write_mcap(series, tmp_path / "log.mcap")
    with open_log(tmp_path / "log.mcap") as opened:
        yield opened


def test_a_log_gives_the_grid_with_most_responses_that_change(log):
    samples, notes = responses_alone(log, None, Span(), progress=no_progress)
    assert samples.names == ("/fast/a.accel.linear.x", "/fast/b.accel.linear.x")
    assert any("/slow/a.accel.linear.x" in note for note in notes)
    assert any("never change" in note and "/fast/c.accel.linear.x" in note for note in notes)


def test_named_channels_of_a_log_are_taken_as_they_are(log):
    samples, notes = responses_alone(log, ["/slow/a.accel.linear.x"], Span(), progress=no_progress)
    assert samples.names == ("/slow/a.accel.linear.x",)
    assert notes == ()


def test_named_channels_of_two_grids_are_joined_and_it_is_said(log):
    names = ["/slow/a.accel.linear.x", "/fast/a.accel.linear.x"]
    samples, notes = responses_alone(log, names, Span(), progress=no_progress)
    assert samples.names == tuple(names)
    (note,) = notes
    assert note.startswith("2 sampling grids joined: brought to ")
    assert "band-limited" in note
