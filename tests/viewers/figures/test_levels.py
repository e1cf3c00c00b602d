"""Levels over time: nothing is drawn over what wasn't measured."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

import chladni
from chladni.signals.study import Study
from chladni.viewers.figures.levels import draw_severity, severity_figures
from chladni.viewers.groups import groups
from chladni.viewers.style import Style


def test_a_line_breaks_where_windows_are_missing() -> None:
    rate_hz, lost = 1000.0, slice(8000, 9000)
    values = np.random.default_rng(0).standard_normal((1, 20_000))
    values[0, lost] = np.nan
    series = chladni.TimeSeries.from_arrays(values, sample_rate_hz=rate_hz, names=["a"], units="m/s^2")
    found = chladni.severity(replace(series, valid=np.isfinite(values)))
    study = Study(title="s", severities=(found,))
    assert list(severity_figures(study)) == ["severity 1.1"]
    axes = Figure().subplots()
    draw_severity(axes, found, groups(found.channels)[0], Style.of(study))
    time_s, rms = axes.lines[0].get_data()
    (gaps,) = np.nonzero(np.isnan(rms))
    assert gaps.size == 1
    assert lost.start / rate_hz < time_s[gaps[0]] < lost.stop / rate_hz
