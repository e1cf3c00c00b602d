"""Measured beside simulated: in time, as spectra, as transfer functions, and as one number."""

from collections.abc import Iterator

import numpy as np

from chladni.apps.frf import frf
from chladni.apps.psd import psd
from chladni.models.core.reading import Chart, Curve, Quantity
from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import rms
from chladni.signals.time_series import TimeSeries
from chladni.viewers.drawing import thin

#: Points of a curve: more than a screen has columns.
MOST_POINTS = 3000
#: Segments side by side in a stretch, seven with their overlap: lines finer than in a spectrum that is read for its
#: levels, since here it's enough to see where two curves part.
SEGMENTS = 4
FEWEST_SAMPLES = 64
MEASURED, SIMULATED = "measured", "simulated"


def comparison_charts(
    driving: TimeSeries, measured: TimeSeries, simulated: TimeSeries, *, start_s: float
) -> tuple[tuple[Chart, ...], tuple[str, ...]]:
    """Give the charts of each output, and what to say about those that there can't be.

    Parameters
    ----------
    driving
        Inputs; transfer functions are over the first.
    measured, simulated
        Outputs, same channels in the same order, on one grid.
    start_s
        Where the stretch begins in the log.

    Returns
    -------
    charts : tuple of Chart
        ``log.time.OUTPUT``, ``log.spectrum.OUTPUT``, ``log.transfer.OUTPUT``.
    words : tuple of str
        Why there is no spectrum or transfer function.
    """
    charts, words = list(_times(measured, simulated, start_s)), []
    if measured.samples < FEWEST_SAMPLES:
        return tuple(charts), (f"{measured.samples} samples are too few for a spectrum; take a longer stretch.",)
    # Each on its own: a record may do for one and not for the other.
    for make in (_spectra, _transfers):
        try:
            charts += make(driving, measured, simulated)
        except EstimateError as error:
            words.append(str(error))
    # Output by output, so that time, spectrum and transfer function of one stand side by side.
    order = [channel.name for channel in measured.channels]
    charts.sort(key=lambda chart: order.index(chart.name.split(".", 2)[2]))
    return tuple(charts), tuple(words)


def scores(measured: TimeSeries, simulated: TimeSeries) -> tuple[Quantity, ...]:
    """Give the NRMSE of each output in percent; None where nothing but zero was measured."""
    found = []
    for channel, real, made in zip(measured.channels, measured.values, simulated.values, strict=True):
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            percent = float(100 * rms(real - made) / rms(real))
        found.append(
            Quantity(
                name=f"NRMSE {channel.name}",
                value=percent if np.isfinite(percent) else None,
                unit="%",
                definition="RMS of measured less simulated over RMS of measured; simulated from rest",
            )
        )
    return tuple(found)


def _times(measured: TimeSeries, simulated: TimeSeries, start_s: float) -> Iterator[Chart]:
    # As the log counts, so that a place found here is found there.
    time_s = start_s + np.arange(measured.samples) / measured.sample_rate_hz
    for channel, real, made in zip(measured.channels, measured.values, simulated.values, strict=True):
        curves = tuple(_thinned(label, time_s, values) for label, values in ((MEASURED, real), (SIMULATED, made)))
        yield Chart(
            name=f"log.time.{channel.name}",
            title=f"{channel.name}, time",
            x_label="time in the log [s]",
            y_label=_label(channel.name, channel.unit),
            curves=curves,
        )


def _spectra(_driving: TimeSeries, measured: TimeSeries, simulated: TimeSeries) -> list[Chart]:
    densities = psd(_joined(measured, simulated), resolution_hz=SEGMENTS / measured.duration_s)
    count = len(measured.channels)
    return [
        Chart(
            name=f"log.spectrum.{channel.name}",
            title=f"{channel.name}, spectrum",
            x_label="frequency [Hz]",
            x_scale="log",
            y_label=_label("PSD", densities.units[row]),
            y_scale="log",
            curves=(
                _line(MEASURED, densities.frequency_hz, densities.values[row]),
                _line(SIMULATED, densities.frequency_hz, densities.values[count + row]),
            ),
        )
        for row, channel in enumerate(measured.channels)
    ]


def _transfers(driving: TimeSeries, measured: TimeSeries, simulated: TimeSeries) -> list[Chart]:
    reference = driving.channels[0].name
    if np.ptp(driving.values[0]) == 0:
        raise EstimateError(f"{reference} is the same all the time in this stretch: there is no transfer function")
    count = len(measured.channels)
    # Measured and simulated in one estimate: same segments, same window, same reference.
    series = _joined(measured, simulated, first=driving)
    names = [channel.name for channel in series.channels[1:]]
    response = frf(
        series, references=_NAMES[0] + reference, responses=names, resolution_hz=SEGMENTS / series.duration_s
    )
    return [
        Chart(
            name=f"log.transfer.{channel.name}",
            title=f"{channel.name} over {reference}",
            x_label="frequency [Hz]",
            x_scale="log",
            y_label=_label("magnitude", response.unit(row, 0)),
            y_scale="log",
            curves=(
                _line(MEASURED, response.frequency_hz, np.abs(response.values[row, 0]), response.excited),
                _line(SIMULATED, response.frequency_hz, np.abs(response.values[count + row, 0]), response.excited),
            ),
        )
        for row, channel in enumerate(measured.channels)
    ]


# In front of names in a joined series, where one output stands twice.
_NAMES = ("input ", "measured ", "simulated ")


def _joined(measured: TimeSeries, simulated: TimeSeries, *, first: TimeSeries | None = None) -> TimeSeries:
    """Give measured and simulated, after the first row of `first`, as one series: one estimate treats all alike."""
    parts = [(_NAMES[1], measured), (_NAMES[2], simulated)]
    rows = [
        (prefix, channel, row)
        for prefix, part in parts
        for channel, row in zip(part.channels, part.values, strict=True)
    ]
    if first is not None:
        rows.insert(0, (_NAMES[0], first.channels[0], first.values[0]))
    return TimeSeries(
        values=np.stack([values for _, _, values in rows]),
        sample_rate_hz=measured.sample_rate_hz,
        channels=tuple(Channel(name=prefix + channel.name, unit=channel.unit) for prefix, channel, _ in rows),
    )


def _thinned(label: str, x: Real, y: Real) -> Curve:
    shown, _ = thin(np.asarray(y, dtype=np.float64), limit=MOST_POINTS)
    return Curve(label=label, x=x[shown], y=np.asarray(y[shown], dtype=np.float64))


def _line(label: str, frequency_hz: Real, values: Real, known: Mask | None = None) -> Curve:
    """Leave out the line at 0 Hz, what isn't known, and zeros, which a logarithmic axis can't show."""
    shown = np.where((values > 0) & (True if known is None else known), values, np.nan)
    return _thinned(label, frequency_hz[1:], shown[1:])


def _label(what: str, unit: str) -> str:
    return what if unit == "1" else f"{what} [{unit}]"
