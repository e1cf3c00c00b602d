"""Show results in rerun."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from chladni.apps.analyse import analyse
from chladni.apps.gap_evidence import gap_evidence
from chladni.apps.unit_peaks import unit_peaks
from chladni.gap.records.diagnosis import Diagnosis
from chladni.io.log import Log
from chladni.modal.shapes.relative_motion import relative_motion
from chladni.modal.shapes.summary import summarise
from chladni.modal.shapes.validation import validate
from chladni.models.core.simulation import Simulation
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.value import Drawn, Value
from chladni.signals.waterfall import Waterfall
from chladni.spectral.peaks import find_response_peaks
from chladni.spectral.psd import power_spectral_density

ValueT = TypeVar("ValueT", bound=Value)
Shown = Log | Drawn | Path | str

# Title of a study that no log has given its name yet.
NAMELESS = "chladni"


def show(*items: Shown, save: Path | str | None = None) -> None:
    """Show logs, series, spectra, transfer functions, modes and every other value side by side in rerun.

    Parameters
    ----------
    items
        A log, or the path to one, is analysed first. What has no view of its own is shown as its picture.
    save
        File ``.rrd`` to write instead of opening the viewer.

    Raises
    ------
    SetupError
        When there is nothing to show, or the viewer doesn't start, as on a computer without a display.
    LogError
        When the file can't be written, or a log can't be read.
    """
    from chladni.viewers import rerun

    if len(items) == 1 and isinstance(items[0], Diagnosis):
        evidence = gap_evidence(items[0])
        if save is None:
            rerun.spawn_gap(evidence)
        else:
            rerun.write_gap_rrd(evidence, save)
        return
    study = gather(*items)
    if save is None:
        rerun.spawn(study)
    else:
        rerun.write_rrd(study, save)


def write_report(item: Shown, path: Path | str, *, interactive: bool | None = None) -> Path:
    """Write what was found as one HTML file that needs nothing else.

    Parameters
    ----------
    item
        A diagnosis; or a study, a log or the path to one, which is analysed first, or any value.
    path
        File to write; one that exists is replaced.
    interactive
        Whether plots zoom and read out, which takes Bokeh; None for where it's installed. Else they are pictures.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    SetupError
        When plots are asked for, and Bokeh isn't installed.
    LogError
        When the file can't be written, or the log can't be read.
    """
    if isinstance(item, Diagnosis):
        from chladni.viewers.report.gap import write_gap_report

        return write_gap_report(gap_evidence(item), path, interactive=interactive)
    from chladni.viewers import report

    return report.write_report(gather(item), path, interactive=interactive)


def gather(*items: Shown) -> Study:
    """Put items into one study; later functions or modes replace earlier ones, with a finding that says so."""
    if not items:
        raise SetupError("nothing to show; give a log, a series, a spectrum, a transfer function or modes")
    studies = [analyse(item) if isinstance(item, Log | Path | str) else item for item in items]
    logs = [item for item in studies if isinstance(item, Study)]
    study = Study(title=NAMELESS)
    if len(logs) > 1:
        told = _since_their_start(logs)
        study = replace(study, logs=tuple(one.title for one in logs), findings=told)
        studies = [_labelled(item, from_start=bool(told)) if isinstance(item, Study) else item for item in studies]
    for item in studies:
        study = _with(study, item)
    # Last: the geometry that relative motion needs may come after the modes.
    return study if study.modes is None or study.validation is not None else _with_checks(study, study.modes)


def _since_their_start(logs: Sequence[Study]) -> tuple[str, ...]:
    """Say so when logs were recorded one after another: they are laid over one another then, each from its start."""
    times = sorted(_times_ns(log) for log in logs if log.series)
    if len(times) < 2 or all(later[0] < earlier[1] for earlier, later in pairwise(times)):
        return ()
    return ("The logs were recorded one after another; each is drawn from its own start.",)


def _times_ns(log: Study) -> tuple[int, int]:
    starts = [one.start_time_ns for one in log.series]
    ends = [one.start_time_ns + round(one.duration_s * NS_PER_S) for one in log.series]
    return min(starts), max(ends)


def _labelled(study: Study, *, from_start: bool) -> Study:
    """Name the log in its findings and channels, which are about to stand beside those of others."""
    zero_ns = _times_ns(study)[0] if from_start and study.series else 0

    def named(value: ValueT) -> ValueT:
        """Give a value whose channels begin with the log's name."""
        changed: dict[str, Any] = {
            field: tuple(one.with_name(of_log(one.name)) for one in getattr(value, field))
            for field in ("channels", "responses", "references")
            if isinstance(getattr(value, field, None), tuple)
        }
        if zero_ns and isinstance(value, TimeSeries | Waterfall):
            changed["start_time_ns"] = value.start_time_ns - zero_ns
        made: ValueT = replace(value, **changed)  # type: ignore[type-var]  # every value is a dataclass
        return made

    def of_log(name: str) -> str:
        return f"{study.title}: {name}"

    def peaks(found: tuple[Peak, ...]) -> tuple[Peak, ...]:
        return tuple(replace(one, channels=tuple(map(of_log, one.channels))) for one in found)

    return replace(
        study,
        series=tuple(map(named, study.series)),
        densities=tuple(map(named, study.densities)),
        waterfalls=tuple(map(named, study.waterfalls)),
        response=None if study.response is None else named(study.response),
        peaks=peaks(study.peaks),
        response_peaks=peaks(study.response_peaks),
        findings=tuple(map(of_log, study.findings)),
    )


def _with(study: Study, item: Drawn) -> Study:
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
        case ModeSet():
            return replace(study, modes=item, validation=None)
        case CrossSpectra() | AutoSpectra():
            return _with(study, power_spectral_density(item))
        case Simulation():
            return _with(_with(study, item.inputs), item.outputs)
        case _:
            return replace(study, pictures=(*study.pictures, _picture(item)))


def _picture(item: object) -> tuple[str, bytes]:
    """Give the title and the picture of what has no view of its own."""
    # matplotlib takes half a second, which most of what is shown does without.
    from chladni.apps.plot import png

    drawn = png(item) if isinstance(item, Drawn) else None
    if drawn is None:
        raise SetupError(f"a {type(item).__name__} can't be shown; give a log, its path, or a value with a picture")
    return re.sub("(?<=[a-z])(?=[A-Z])", " ", type(item).__name__).capitalize(), drawn


def _with_checks(study: Study, modes: ModeSet) -> Study:
    validation, motions = validate(modes), relative_motion(modes, study.geometry)
    return replace(
        study,
        validation=validation,
        relative_motion=motions,
        # The notes of the functions stand in both.
        findings=tuple(
            dict.fromkeys([*study.findings, *summarise(modes, validation, motions, geometry=study.geometry)])
        ),
    )


def _joined(first: Study, second: Study) -> Study:
    replaced = [
        f"The {what} shown are those of {second.title}; view the other log alone for its own."
        for what, one, other in (
            ("transfer functions", first.response, second.response),
            ("modes", first.modes, second.modes),
        )
        if one is not None and other is not None
    ]
    modal = second if second.modes is not None else first
    return Study(
        title=second.title if first.title == NAMELESS else f"{first.title}, {second.title}",
        series=first.series + second.series,
        densities=first.densities + second.densities,
        waterfalls=first.waterfalls + second.waterfalls,
        response=second.response or first.response,
        peaks=first.peaks + second.peaks,
        response_peaks=second.response_peaks if second.response is not None else first.response_peaks,
        modes=modal.modes,
        validation=modal.validation,
        relative_motion=modal.relative_motion,
        geometry=second.geometry if second.geometry.points else first.geometry,
        findings=(*first.findings, *second.findings, *replaced),
        pictures=(*first.pictures, *second.pictures),
        logs=first.logs or second.logs,
    )
