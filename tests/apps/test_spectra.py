import numpy as np
import pytest
from scipy import signal

import chladni
from chladni.apps.psd import densities
from chladni.apps.sources import Span, watched_grids
from chladni.apps.spectra import Averaging
from chladni.io import source
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, LogError
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries
from tests.arm import FORCE, TOOL, WRIST, write_arm
from tests.make_logs import GAIN, LATE_S, write_driven


@pytest.fixture(scope="module")
def arm_log(tmp_path_factory):
    return write_arm(tmp_path_factory.mktemp("arm"))


@pytest.fixture
def large(monkeypatch):
    """Treat every log as one that doesn't fit in memory, in blocks of about a second."""
    monkeypatch.setattr(source, "IN_MEMORY_BYTES", 0)
    monkeypatch.setattr(source, "VALUES_IN_A_BLOCK", 1)


def noise(samples=20_000, channels=("a", "b"), rate_hz=500.0):
    rng = np.random.default_rng(5)
    return TimeSeries(
        values=rng.standard_normal((len(channels), samples)),
        sample_rate_hz=rate_hz,
        channels=tuple(Channel(name=name, unit="m/s^2") for name in channels),
    )


def test_a_density_is_welchs():
    series = noise()
    found = chladni.psd(series, channels=["b"], resolution_hz=1.0)
    _, expected = signal.welch(series.values[1], 500.0, nperseg=500, noverlap=250, detrend="constant")
    np.testing.assert_allclose(found.values[0], expected, rtol=1e-12)
    assert [channel.name for channel in found.channels] == ["b"]


def test_a_window_of_time_is_cut_out_of_a_series():
    found = chladni.psd(noise(), start_s=10.0, end_s=20.0, resolution_hz=1.0, overlap=0.0)
    assert found.provenance.averages == 10


def test_a_log_and_its_samples_have_the_same_density(arm_log):
    with chladni.open_log(arm_log) as log:
        assert_close(chladni.psd(log), chladni.psd(log.read()), rtol=1e-12)


def test_a_large_log_is_averaged_block_by_block_to_the_same(arm_log, large):
    with chladni.open_log(arm_log) as log:
        in_memory = chladni.psd(log.read())
        assert_close(chladni.psd(log), in_memory, rtol=1e-12)
        whole = chladni.frf(log.read(), references=FORCE, resolution_hz=1.0)
        assert_close(chladni.frf(log, references=FORCE, resolution_hz=1.0), whole, rtol=1e-9)


def test_progress_rises_to_one(arm_log, large):
    shares = []
    with chladni.open_log(arm_log) as log:
        densities(log, channels=[TOOL], progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0, abs=0.05)
    assert len(shares) > 10


def two_rates(folder):
    fast, slow = noise(8000, ("/fast.accel.linear.x",), 400.0), noise(2000, ("/slow.accel.linear.x",), 100.0)
    still = TimeSeries(
        values=np.full((1, 8000), 2.5), sample_rate_hz=400.0, channels=(Channel(name="/still.accel.linear.x"),)
    )
    chladni.write_mcap([fast, slow, still], folder / "two.mcap")
    return folder / "two.mcap"


def test_channels_of_different_rates_get_a_density_each(tmp_path):
    with chladni.open_log(two_rates(tmp_path)) as log:
        found = densities(log)
        with pytest.raises(LogError, match="sample_rate_hz"):
            chladni.psd(log)
    by_name = {channel.name: density for density in found for channel in density.channels}
    assert set(by_name) == {"/fast.accel.linear.x", "/slow.accel.linear.x"}
    assert by_name["/fast.accel.linear.x"].frequency_hz[-1] == 200.0
    assert by_name["/slow.accel.linear.x"].frequency_hz[-1] == 50.0
    notes = [note for density in found for note in density.provenance.notes]
    assert any("never change" in note and "/still" in note for note in notes)


def test_a_log_in_which_nothing_moves_is_refused(tmp_path):
    with chladni.open_log(two_rates(tmp_path)) as log, pytest.raises(EstimateError, match="no channel changes"):
        densities(log, channels=["/still.accel.linear.x"])


def test_responses_default_to_what_moves_on_the_references_clock(tmp_path):
    with chladni.open_log(two_rates(tmp_path)) as log:
        with pytest.raises(EstimateError, match="response"):
            chladni.frf(log, references="/slow.accel.linear.x")
        named = chladni.frf(log, references="/slow.accel.linear.x", responses="/fast.accel.linear.x")
    assert named.frequency_hz[-1] == 50.0
    assert any("2 sampling grids joined: brought to 100 Hz by band-limited" in one for one in named.provenance.notes)


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    path = tmp_path_factory.mktemp("driven") / "drive.mcap"
    write_driven(path)
    return path


def test_commands_are_held_between_their_messages(driven):
    with chladni.open_log(driven) as log:
        found = chladni.frf(log, references="/drive.data", responses="/encoder.data", resolution_hz=0.5)
    assert found.frequency_hz[-1] == 125.0
    low = (found.frequency_hz > 0.5) & (found.frequency_hz < 24.0)
    expected = GAIN * np.exp(-2j * np.pi * LATE_S * found.frequency_hz)
    # The state is exact; what is left of windows of 2 s of a delay of 12 ms.
    np.testing.assert_allclose(found.values[0, 0, low], expected[low], atol=0.02)
    assert any("its message type is a command" in note for note in found.provenance.notes)


def test_the_way_of_joining_can_be_named(driven):
    with chladni.open_log(driven) as log:
        smooth = chladni.frf(log, references="/drive.data", responses="/encoder.data", join="band-limited")
        series = log.read(["/encoder.data", "/drive.data"], join="auto")
        with pytest.raises(LogError, match="different sampling grids"):
            log.read(["/encoder.data", "/drive.data"])
    assert smooth.frequency_hz[-1] == 25.0
    assert not any("held" in note for note in smooth.provenance.notes)
    assert [channel.name for channel in series.channels] == ["/encoder.data", "/drive.data"]
    assert series.sample_rate_hz == 250.0
    # Both begin where the encoder does, three samples after the first command.
    np.testing.assert_array_equal(series.values[0, 3:], GAIN * series.values[1, :-3])


def test_a_response_of_a_series_and_of_its_log_agree(arm_log):
    with chladni.open_log(arm_log) as log:
        found = chladni.frf(log, references=FORCE, responses=[TOOL, WRIST], resolution_hz=1.0)
        series = log.read([FORCE, TOOL, WRIST])
    assert_close(found, chladni.frf(series, references=FORCE, resolution_hz=1.0), rtol=1e-12)
    assert found.values.shape[:2] == (2, 1)


def test_a_reference_is_needed(arm_log):
    with chladni.open_log(arm_log) as log, pytest.raises(EstimateError, match="no reference is given"):
        chladni.frf(log, references=[])


def test_a_hammer_is_recognised(shared_data):
    with chladni.open_log(shared_data / "hammer.mcap") as log:
        found = chladni.frf(log, references="/daq.hammer")
        shorter = chladni.frf(log, references="/daq.hammer", resolution_hz=2.0)
        told = chladni.frf(log, references="/daq.hammer", window="hann", resolution_hz=2.0)
    assert (found.provenance.averaging, found.provenance.averages) == ("impact", 3)
    rejected = [note for note in found.provenance.notes if "rejected" in note]
    assert [note.split(" at ")[0] for note in rejected] == ["record 1", "record 3"]
    assert shorter.frequency_hz[1] == pytest.approx(2.0, rel=1e-3)
    assert told.provenance.averaging == "linear"


@pytest.mark.parametrize(
    ("level", "frequency_hz", "height"), [(1, 7.324, 0.258), (3, 7.275, 0.233), (5, 7.227, 0.097), (7, 7.227, 0.075)]
)
def test_the_aircrafts_torsion_by_default_settings(shared_data, level, frequency_hz, height):
    with chladni.open_log(shared_data / f"f16_level{level}.mcap") as log:
        found = chladni.frf(log, references="/shaker.wrench.force.z", responses="/payload_rail.accel.linear.z")
    peaks = chladni.find_response_peaks(found)
    torsion = max((peak for peak in peaks if 6.8 < peak.frequency_hz < 7.8), key=lambda peak: peak.height)
    assert torsion.frequency_hz == pytest.approx(frequency_hz, abs=0.02)
    assert torsion.height == pytest.approx(height, rel=0.05)
    assert all(2.0 <= peak.frequency_hz <= 15.0 for peak in peaks)


def log_of(tmp_path, rows, *, rate_hz=200.0, valid=None):
    channels = tuple(Channel(name=f"/{name}.accel.linear.x", unit="m/s^2") for name in rows)
    series = TimeSeries(values=np.stack(list(rows.values())), sample_rate_hz=rate_hz, channels=channels, valid=valid)
    chladni.write_mcap([series], tmp_path / "made.mcap")
    return chladni.open_log(tmp_path / "made.mcap")


def test_variance_slower_than_the_segments_is_told(tmp_path):
    # A press moves at 0.5 Hz for 23 s: segments chosen by the record's length hold two thirds of a stroke.
    time_s = np.arange(4600) / 200
    rows = {"stroke": np.sin(np.pi * time_s), "noise": np.random.default_rng(1).standard_normal(time_s.size)}
    with log_of(tmp_path, rows) as log:
        (coarse,), (fine,) = densities(log), densities(log, averaging=Averaging(resolution_hz=0.1))
    (note,) = coarse.provenance.notes
    # Lines 0.781 Hz apart, peaks from 1.17 Hz on: what lies above is leakage.
    above = coarse.frequency_hz > 1.2
    within = coarse.values[0, above].sum() * coarse.frequency_hz[1]
    assert note.startswith("/stroke.accel.linear.x: up to ")
    share = float(note.split("up to ")[1].split("%")[0]) / 100
    assert share == pytest.approx(1 - within / rows["stroke"].var(), abs=0.02)
    assert "slower than 1.17 Hz" in note
    assert "ask for a resolution of 0.18 Hz" in note
    assert not fine.provenance.notes


def test_a_tone_in_lines_that_are_not_judged_is_told_with_what_shows_it():
    # 5 s at 400 Hz have lines 6.25 Hz apart, of which those above 9.4 Hz are judged.
    time_s = np.arange(2000) / 400

    def tone(frequency_hz):
        values = np.sin(2 * np.pi * frequency_hz * time_s)[np.newaxis]
        return TimeSeries(values=values, sample_rate_hz=400.0, channels=(Channel(name="a", unit="m/s^2"),))

    found = chladni.psd(tone(20.0))
    assert found.provenance.notes == ()
    (peak,) = chladni.find_peaks(found)
    assert peak.frequency_hz == pytest.approx(20.0, abs=0.05)
    below = chladni.psd(tone(6.0))
    assert chladni.find_peaks(below) == ()
    (note,) = below.provenance.notes
    assert "slower than 9.38 Hz" in note
    asked_hz = float(note.split("ask for a resolution of ")[1].split(" Hz")[0])
    (followed,) = chladni.find_peaks(chladni.psd(tone(6.0), resolution_hz=asked_hz))
    assert followed.frequency_hz == pytest.approx(6.0, abs=asked_hz / 2)


def test_the_variance_of_a_large_log_is_watched_block_by_block(tmp_path, large):
    rows = {"stroke": 7 + np.sin(np.pi * np.arange(4600) / 200)}
    with log_of(tmp_path, rows) as log:
        (grid,) = watched_grids(log, None, Span())
        assert len(list(grid)) > 1
        assert grid.variance("/stroke.accel.linear.x") == pytest.approx(rows["stroke"].var(), rel=1e-12)
        assert grid.variance("/none") == 0


def test_segments_that_a_gap_costs_are_told(tmp_path):
    rows = {"a": np.random.default_rng(2).standard_normal(4096)}
    valid = np.ones((1, 4096), dtype=bool)
    valid[0, 1000:1010] = False
    with log_of(tmp_path, rows, valid=valid) as log:
        (found,) = densities(log)
    account = found.provenance
    assert account.skipped > 0
    total = account.averages + account.skipped
    assert account.notes == (f"{account.skipped} of {total} segments are left out: samples are missing in them",)


def test_no_segment_between_gaps_says_which_resolution_would_do(tmp_path):
    valid = np.ones((1, 4000), dtype=bool)
    # At random, 49 samples apart at most: an even one in fifty is what a clock that ticks every 10 ms makes of 98 Hz.
    lost = np.cumsum(np.append(49, np.random.default_rng(8).integers(3, 51, 300)))
    valid[0, lost[lost < 4000]] = False
    rows = {"a": np.random.default_rng(3).standard_normal(4000)}
    with log_of(tmp_path, rows, rate_hz=100.0, valid=valid) as log:
        with pytest.raises(EstimateError, match=r"/a\.accel.*ask for 2\.05 Hz or coarser"):
            densities(log, averaging=Averaging(resolution_hz=1.0))
        assert densities(log, averaging=Averaging(resolution_hz=2.05))
        # Without a wish the segments are as long as fit: 32 of the 49 samples between gaps.
        (density,) = densities(log)
        assert density.frequency_hz[1] == pytest.approx(100 / 32)


def test_a_reference_that_never_changes_is_refused(tmp_path):
    rows = {"dead": np.zeros(4000), "a": np.random.default_rng(4).standard_normal(4000)}
    with log_of(tmp_path, rows) as log, pytest.raises(EstimateError, match=r"made\.mcap: /dead.*excites nothing"):
        chladni.frf(log, references="/dead.accel.linear.x")


def test_values_too_large_to_square_are_an_error_that_names_their_channel(tmp_path):
    rows = {"broken": 1e200 * np.random.default_rng(5).standard_normal(4000)}
    with log_of(tmp_path, rows) as log, pytest.raises(EstimateError, match=r"/broken.* holds values up to"):
        densities(log)


def test_a_reference_is_no_response_of_its_own(tmp_path):
    rows = {"a": np.random.default_rng(2).standard_normal(4096), "b": np.random.default_rng(3).standard_normal(4096)}
    with log_of(tmp_path, rows) as log:
        for source in (log, log.read()):
            with pytest.raises(EstimateError, match="reference and response at once"):
                chladni.frf(source, references="/a.accel.linear.x", responses=["/a.accel.linear.x"])
