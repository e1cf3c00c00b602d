import numpy as np
import pytest

from chladni.modal.operational import steady_line
from chladni.modal.operational.steady_line import steady_lines
from tests.modal.operational.test_narrow_band_kurtosis import LIGHT, series_of
from tests.modal.truth import ambient_record


@pytest.mark.parametrize("cycles", [300, 3000])
def test_the_chance_of_a_line_of_a_mode_is_not_understated(cycles):
    rng = np.random.default_rng(cycles)
    lowest = []
    for _ in range(100):
        record = steady_lines(ambient_record(LIGHT, cycles=cycles, rng=rng), 0.003)
        lowest.append(record.chance[0, 20:].min() * record.chance.shape[1])
    # Of 100 records one in ten may show a line with a chance of a tenth over the number of lines; 20 are six sigma
    # less likely than that... in half of the records the lowest must stay above ln 2, were lines independent.
    assert np.mean(np.array(lowest) < 0.1) <= 0.2
    assert np.median(lowest) > 0.5


def test_a_sine_stands_out_by_its_power_over_the_noise_in_a_line():
    rng = np.random.default_rng(8)
    time_s = np.arange(60_000) / 100
    series = series_of(np.sqrt(2) * 0.1 * np.sin(2 * np.pi * 12.5 * time_s) + rng.standard_normal(time_s.size))
    record = steady_lines(series, 0.001)
    line = round(12.5 * 600)
    # RMS^2 of the sine over density 2/100 times the noise bandwidth 1.5/600 Hz, and the noise itself; scatter of
    # the line: 2/sqrt(200), of the neighbours 1/sqrt(16).
    assert record.over_neighbours[0, line] == pytest.approx(0.01 / (0.02 * 1.5 / 600), rel=0.6)
    assert np.argmin(record.chance[0]) == line
    assert record.chance[0, line] < 1e-12


def test_a_long_record_is_averaged_over_pieces(monkeypatch):
    monkeypatch.setattr(steady_line, "LONGEST_PIECE", 2000)
    rng = np.random.default_rng(9)
    time_s = np.arange(60_000) / 100
    series = series_of(np.sqrt(2) * np.sin(2 * np.pi * 12.5 * time_s) + rng.standard_normal(time_s.size))
    record = steady_lines(series, 0.001)
    assert record.segment_s == 20.0
    assert record.frequency_hz[np.argmin(record.chance[0])] == 12.5


def test_lines_near_the_ends_have_no_neighbours_and_are_no_sines():
    record = steady_lines(series_of(np.random.default_rng(10).standard_normal(1000)), 0.001)
    assert np.all(record.over_neighbours[0, :18] == 0)
    assert np.all(record.chance[0, :18] == 1)
    assert np.all(record.chance[0, -18:] == 1)
