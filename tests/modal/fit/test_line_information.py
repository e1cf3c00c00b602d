"""The factor for correlated lines: closed forms, and the scatter of sums over lines in simulated averages."""

import numpy as np
import pytest

from chladni.modal.fit.line_information import line_correlation_factor
from chladni.signals.channel import Channel
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response


def test_closed_forms():
    def factor(**given):
        return line_correlation_factor(Provenance(**given))

    assert factor(window="boxcar", averages=9) == pytest.approx(1.0)
    assert factor(window="hann", averages=1) == pytest.approx(35 / 18)
    assert factor(window="hann", averages=50) == pytest.approx(35 / 18)
    # With half overlap: c = 35/18 (1 + 2 * 3/70 (1 - 1/K)), rho = 1 + 2/36 (1 - 1/K).
    for count in (2, 10, 10**6):
        pairs = 2 * (1 - 1 / count)
        expected = 35 / 18 * (1 + pairs * 3 / 70) / (1 + pairs / 36)
        assert factor(window="hann", overlap=0.5, averages=count) == pytest.approx(expected, rel=1e-9)
    assert factor(window="hann", overlap=0.5, averages=10**9) == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize("averaging", ["periodic", "impact"])
def test_whole_responses_have_independent_lines(averaging):
    assert line_correlation_factor(Provenance(window="hann", averaging=averaging, averages=8)) == 1.0


@pytest.mark.parametrize(
    ("window", "overlap"), [("hann", 0.5), pytest.param("hann", 0.75, marks=pytest.mark.nightly), ("boxcar", 0.0)]
)
def test_sums_over_lines_scatter_so(window, overlap):
    # An output of pure noise over an input of noise: the mean over lines of H scatters by the factor over its lines.
    rng = np.random.default_rng(4)
    channels = (Channel(name="x", unit="N"), Channel(name="y", unit="m/s^2"))
    ratios = []
    for _ in range(200):
        series = TimeSeries(values=rng.standard_normal((2, 8192)), sample_rate_hz=256.0, channels=channels)
        spectra = cross_spectra(series, resolution_hz=1.0, window=window, overlap=overlap)
        response = frequency_response(spectra, references="x")
        h, std = response.values[0, 0, 5:-5], response.std[0, 0, 5:-5]
        independent = np.sqrt(np.sum(std**2)) * np.sqrt(line_correlation_factor(response.provenance))
        ratios += [h.sum().real / independent, h.sum().imag / independent]
    # 400 numbers tell their sigma within 3.5 %; four of that.
    assert np.std(ratios) == pytest.approx(1.0, abs=0.14)
