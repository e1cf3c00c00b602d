"""The tour: make a robot arm's log with known truth, analyse it, and set what was found beside the truth."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chladni.apps.analyse import analyse
from chladni.apps.demo_log import (
    LOST_FROM_S,
    LOST_SENSOR,
    LOST_TO_S,
    SHAKEN,
    DemoLog,
    make_demo_log,
    setup_text,
)
from chladni.apps.modes import Wanted, modes_of_response
from chladni.apps.show import gather
from chladni.apps.sources import Progress, no_progress
from chladni.io.atomic import atomic_write
from chladni.io.folder import made_folder
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.arrays import Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study

RESOLUTION_HZ = 0.125
# Peaks this far apart, relative, are different ones.
SAME_PEAK = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One found number beside its truth; `std` is its own one sigma."""

    what: str
    found: float | None
    std: float
    truth: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tour:
    """What the tour made.

    Attributes
    ----------
    study
        The analysis.
    comparisons
        Found beside true.
    files
        Everything written, in the order of interest.
    """

    study: Study
    comparisons: tuple[Comparison, ...]
    files: tuple[Path, ...]


def run_tour(folder: Path, *, progress: Progress = no_progress) -> Tour:
    """Run the tour and write log, setup, recording, report and figures to `folder`, which is made if needed.

    Raises
    ------
    LogError
        When the folder can't be made or written to.
    """
    from chladni.viewers.figures import Album, save_album
    from chladni.viewers.report import write_report
    from chladni.viewers.rerun import write_rrd

    made_folder(folder)
    made = make_demo_log()
    progress(0.1)
    log_path, setup_path = folder / "arm.mcap", folder / "setup.toml"
    write_mcap(made.series, log_path, metadata={"truth": _truth(made)})
    with atomic_write(setup_path) as file:
        file.write(setup_text(made.structure).encode())
    progress(0.4)
    with open_log(log_path, setup=setup_path) as log:
        study = analyse(log, resolution_hz=RESOLUTION_HZ)
        gaps = next(one.gaps for one in log.info().channels if one.channel.name == _name(LOST_SENSOR))
    progress(0.55)
    modes = modes_of_response(_shaken(study), method=None, wanted=Wanted())
    study = gather(study, modes)
    progress(0.65)
    recording = write_rrd(study, folder / "arm.rrd")
    progress(0.7)
    album = Album.of(study)
    report = write_report(study, folder / "report.html", album=album)
    progress(0.85)
    figures = save_album(album, folder / "figures")
    progress(1.0)
    return Tour(
        study=study,
        comparisons=(
            *_modes_beside_truth(modes, made),
            *_peaks_beside_truth(study, made),
            *_gap_beside_truth(gaps),
        ),
        files=(recording, report, log_path, setup_path, *figures),
    )


def _truth(made: DemoLog) -> dict[str, str]:
    modes = zip(made.modes.frequency_hz, made.modes.damping_ratio, strict=True)
    told = {f"mode_{number}": f"{f:.6f} Hz, damping ratio {zeta:.6f}" for number, (f, zeta) in enumerate(modes, 1)}
    return told | {"lost": f"{LOST_SENSOR} from {LOST_FROM_S} s to {LOST_TO_S} s"}


def _name(body: str) -> str:
    return f"/{body}.accel.linear.x"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Top:
    """A peak of an exact accelerance."""

    body: str
    frequency_hz: float
    height: float
    prominence_db: float


def _shaken(study: Study) -> FrequencyResponse:
    if study.response is None:
        raise AssertionError("the tour's log has a force")
    return study.response


def _modes_beside_truth(modes: ModeSet, made: DemoLog) -> list[Comparison]:
    """For each natural mode, set the identified one nearest to it beside its closed form."""
    true = zip(made.modes.frequency_hz.tolist(), made.modes.damping_ratio.tolist(), strict=True)
    return [row for number, (f, zeta) in enumerate(true, 1) for row in _mode_beside_truth(modes, number, f, zeta)]


def _mode_beside_truth(modes: ModeSet, number: int, frequency_hz: float, damping: float) -> list[Comparison]:
    near = np.flatnonzero(np.abs(modes.frequency_hz / frequency_hz - 1) < SAME_PEAK)
    nearest = near[np.argsort(np.abs(modes.frequency_hz[near] - frequency_hz))[:1]]
    numbers = (
        ("natural frequency", modes.frequency_hz, modes.frequency_std_hz, frequency_hz, "Hz"),
        ("damping ratio", 100 * modes.damping_ratio, 100 * modes.damping_std, 100 * damping, "%"),
    )
    return [
        Comparison(
            what=f"mode {number}: {what}",
            found=float(found[nearest[0]]) if nearest.size else None,
            std=float(std[nearest[0]]) if nearest.size else 0.0,
            truth=truth,
            unit=unit,
        )
        for what, found, std, truth, unit in numbers
    ]


def _peaks_beside_truth(study: Study, made: DemoLog) -> list[Comparison]:
    """For each natural mode, set the transfer function that shows it best beside the exact one."""
    tops = _tops(made)
    rows = []
    for natural_hz in made.modes.frequency_hz:
        near = [top for top in tops if abs(top.frequency_hz / natural_hz - 1) < SAME_PEAK]
        clearest = max(near, key=lambda top: top.prominence_db)
        rows += _beside(study, clearest)
    return rows


def _tops(made: DemoLog) -> list[_Top]:
    """Every peak of every body's exact accelerance."""
    frequency_hz = np.linspace(5.0, 300.0, 59_001)
    accelerance = made.structure.accelerance(frequency_hz)[:, made.structure.body_index(SHAKEN)]
    levels_db = 20 * np.log10(np.abs(accelerance))
    return [
        _Top(
            body=body.name,
            frequency_hz=float(frequency_hz[line]),
            height=float(10 ** (level_db[line] / 20)),
            prominence_db=_prominence(level_db, line),
        )
        for body, level_db in zip(made.structure.bodies, levels_db, strict=True)
        for line in _local_maxima(level_db)
    ]


def _local_maxima(level: Real) -> list[int]:
    rising = np.diff(level) > 0
    return (1 + np.flatnonzero(rising[:-1] & ~rising[1:])).tolist()


def _prominence(level: Real, line: int) -> float:
    """How far one goes down from a peak, to the side that goes down less, before it goes up to somewhere higher.

    `scipy.signal` knows the same, but takes a second to import, and nothing else in the tour needs it.
    """
    higher = np.concatenate([[-1], np.flatnonzero(level > level[line]), [level.size]])
    right = int(np.searchsorted(higher, line))
    feet = level[higher[right - 1] + 1 : line + 1].min(), level[line : higher[right]].min()
    return float(level[line] - max(feet))


def _beside(study: Study, top: _Top) -> list[Comparison]:
    mine = [peak for peak in study.response_peaks if peak.channels[0] == _name(top.body)]
    near = [peak for peak in mine if abs(peak.frequency_hz / top.frequency_hz - 1) < SAME_PEAK]
    peak = min(near, key=lambda peak: abs(peak.frequency_hz - top.frequency_hz), default=None)
    what = f"{top.body} over shaker, peak near {top.frequency_hz:.0f} Hz"
    return [
        Comparison(
            what=f"{what}: frequency",
            found=None if peak is None else peak.frequency_hz,
            std=0.0 if peak is None else peak.frequency_std_hz,
            truth=top.frequency_hz,
            unit="Hz",
        ),
        Comparison(
            what=f"{what}: height",
            found=None if peak is None else peak.height,
            std=0.0 if peak is None else peak.height_std,
            truth=top.height,
            unit="(m/s^2)/N",
        ),
    ]


def _gap_beside_truth(gaps: tuple[tuple[float, float], ...]) -> list[Comparison]:
    start, end = gaps[0] if gaps else (None, None)
    what = f"messages of the {LOST_SENSOR}'s sensor lost"
    return [
        Comparison(what=f"{what}, from", found=start, std=0.0, truth=LOST_FROM_S, unit="s"),
        Comparison(what=f"{what}, to", found=end, std=0.0, truth=LOST_TO_S, unit="s"),
    ]
