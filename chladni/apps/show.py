"""Show results in rerun."""

from dataclasses import replace

from chladni.apps.analyse import analyse
from chladni.apps.unit_peaks import unit_peaks
from chladni.io.log import Log
from chladni.signals.errors import SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.signals.waterfall import Waterfall
from chladni.spectral.peaks import find_response_peaks

Analysed = Study | TimeSeries | PowerSpectralDensity | FrequencyResponse | Waterfall
Shown = Log | Analysed

# Title of a study that no log has given its name yet.
NAMELESS = "chladni"


def show(*items: Shown) -> None:
    """Open the rerun viewer with logs, series, spectra and transfer functions side by side.

    Parameters
    ----------
    items
        A log is analysed first; all else is shown as it is.

    Raises
    ------
    SetupError
        When there is nothing to show, or the viewer doesn't start, as on a computer without a display.
    """
    from chladni.viewers.rerun import spawn

    spawn(gather(*items))


def gather(*items: Shown) -> Study:
    """Put items into one study; a later transfer function replaces an earlier one, with a finding that says so."""
    if not items:
        raise SetupError("nothing to show; give a log, a series, a spectrum or a transfer function")
    studies = [analyse(item) if isinstance(item, Log) else item for item in items]
    several = sum(isinstance(item, Study) for item in studies) > 1
    study = Study(title=NAMELESS)
    for item in studies:
        study = _with(study, _labelled(item) if several and isinstance(item, Study) else item)
    return study


def _labelled(study: Study) -> Study:
    """Name the log in its findings, which are about to stand beside those of others."""
    return replace(study, findings=tuple(f"{study.title}: {finding}" for finding in study.findings))


def _with(study: Study, item: Analysed) -> Study:
    match item:
        case Study():
            return _joined(study, item)
        case TimeSeries():
            return replace(study, series=(*study.series, item))
        case PowerSpectralDensity():
            peaks = (*study.peaks, *(peak for group in unit_peaks(item) for peak in group.peaks))
            return replace(study, densities=(*study.densities, item), peaks=peaks)
        case Waterfall():
            return replace(study, waterfalls=(*study.waterfalls, item))
        case FrequencyResponse():
            return replace(study, response=item, response_peaks=find_response_peaks(item))


def _joined(first: Study, second: Study) -> Study:
    replaced: tuple[str, ...] = ()
    if first.response is not None and second.response is not None:
        replaced = (
            f"The transfer functions shown are those of {second.title}; view the other log alone for its own.",
        )
    return Study(
        title=second.title if first.title == NAMELESS else f"{first.title}, {second.title}",
        series=first.series + second.series,
        densities=first.densities + second.densities,
        waterfalls=first.waterfalls + second.waterfalls,
        response=second.response or first.response,
        peaks=first.peaks + second.peaks,
        response_peaks=second.response_peaks if second.response is not None else first.response_peaks,
        geometry=second.geometry if second.geometry.points else first.geometry,
        findings=(*first.findings, *second.findings, *replaced),
    )
