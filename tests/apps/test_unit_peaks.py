import numpy as np

from chladni.apps.unit_peaks import unit_peaks
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.psd import power_spectral_density


def test_peaks_are_ranked_among_channels_of_one_unit():
    time_s = np.arange(20_000) / 500
    noise = 1e-3 * np.random.default_rng(1).standard_normal((3, time_s.size))
    tones = [(100.0, 40.0), (0.1, 60.0), (0.2, 80.0)]
    values = noise + np.stack([size * np.sin(2 * np.pi * hz * time_s) for size, hz in tones])
    channels = (Channel(name="f", unit="N"), Channel(name="a", unit="m/s^2"), Channel(name="b", unit="m/s^2"))
    series = TimeSeries(values=values, sample_rate_hz=500.0, channels=channels)
    force, motion = unit_peaks(power_spectral_density(cross_spectra(series, resolution_hz=0.5)))
    assert (force.unit, force.channels) == ("N", ("f",))
    assert round(force.peaks[0].frequency_hz) == 40
    assert (motion.unit, motion.channels) == ("m/s^2", ("a", "b"))
    assert [round(peak.frequency_hz) for peak in motion.peaks[:2]] == [80, 60]
