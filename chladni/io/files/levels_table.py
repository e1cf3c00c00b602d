"""Levels as a table for spreadsheets."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from chladni.io.atomic import atomic_path
from chladni.io.files.modes_table import number_text, write_table
from chladni.signals.levels import Levels, Severity
from chladni.signals.visible import cell_text

_COLUMNS = (
    "channel",
    "unit",
    "low [Hz]",
    "high [Hz]",
    "samples",
    "mean",
    "RMS",
    "RMS std",
    "peak",
    "peak to peak",
    "crest factor [1]",
    "skewness [1]",
    "kurtosis [1]",
    "severity [mm/s]",
    "severity std [mm/s]",
    "zone",
)


def write_levels_csv(path: Path | str, levels: Sequence[Levels], severities: Sequence[Severity] = ()) -> Path:
    """Write levels to `path`, one row for each channel and band; severities stand in each row of their channel.

    Raises
    ------
    LogError
        When the file can't be written.

    Notes
    -----
    As `write_modes_csv` does: RFC 4180, 17 significant digits, an empty field for what isn't known.
    """
    judged = {channel.name: (one, row) for one in severities for row, channel in enumerate(one.channels)}
    table = Path(path)
    with atomic_path(table, overwrite=True) as place:
        write_table(place, _COLUMNS, (row for one in levels for row in _rows(one, judged)))
    return table


def _rows(levels: Levels, judged: dict[str, tuple[Severity, int]]) -> Iterable[list[str]]:
    for row, channel in enumerate(levels.channels):
        severity = _severity(*judged[channel.name]) if channel.name in judged else ["", "", ""]
        for column, (low_hz, high_hz) in enumerate(levels.bands_hz):
            numbers = (
                levels.mean,
                levels.rms,
                levels.rms_std,
                levels.peak,
                levels.peak_to_peak,
                levels.crest_factor,
                levels.skewness,
                levels.kurtosis,
            )
            yield [
                cell_text(channel.name),
                cell_text(channel.unit),
                number_text(low_hz),
                number_text(high_hz),
                str(levels.samples[row, column]),
                *(number_text(one[row, column]) for one in numbers),
                *severity,
            ]


def _severity(found: Severity, row: int) -> list[str]:
    zone = found.zones[row] if found.zones else ""
    return [number_text(found.velocity_mm_s[row]), number_text(found.velocity_std_mm_s[row]), zone]
