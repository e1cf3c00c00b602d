"""Modes and shapes as tables for spreadsheets."""

import csv
from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path

from chladni.io.atomic import atomic_path
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.visible import cell_text

_MODE_COLUMNS = (
    "mode",
    "frequency [Hz]",
    "frequency std [Hz]",
    "damping ratio [1]",
    "damping ratio std [1]",
    "modal mass [kg]",
    "modal mass std [kg]",
    "model orders [1]",
    "MPC [1]",
    "MPD [deg]",
    "mean phase [deg]",
)
_SHAPE_COLUMNS = (
    "mode",
    "frequency [Hz]",
    "channel",
    "point",
    "direction x [1]",
    "direction y [1]",
    "direction z [1]",
    "real [1]",
    "real std [1]",
    "imaginary [1]",
    "imaginary std [1]",
    "amplitude [1]",
)


def write_modes_csv(
    path: Path | str, modes: ModeSet, *, validation: ModeValidation | None = None, overwrite: bool = True
) -> tuple[Path, Path]:
    """Write a table of modes to `path`, and one of their shapes beside it.

    Parameters
    ----------
    path
        Such as ``arm.csv``; the shapes go to ``arm_shapes.csv``.
    validation
        Of the same modes, for the columns MPC, MPD and mean phase; they stay empty without.

    Returns
    -------
    Both paths: modes, shapes.

    Raises
    ------
    LogError
        When a file can't be written, or exists and `overwrite` is false.

    Notes
    -----
    RFC 4180, one header line with units, decimal points, 17 significant digits; modes count from 1, as in sentences.
    What isn't known is an empty field. An apostrophe marks names that a spreadsheet would take for a formula, and
    those with characters that aren't seen, which are written as escapes.
    Modal masses are in kg for forces in N and translations.
    """
    table = Path(path)
    shapes = table.with_name(f"{table.stem}_shapes{table.suffix}")
    # Both appear, or neither.
    with atomic_path(table, overwrite=overwrite) as first, atomic_path(shapes, overwrite=overwrite) as second:
        write_table(first, _MODE_COLUMNS, _mode_rows(modes, validation))
        write_table(second, _SHAPE_COLUMNS, _shape_rows(modes))
    return table, shapes


def _mode_rows(modes: ModeSet, validation: ModeValidation | None) -> Iterable[list[str]]:
    for row in range(modes.frequency_hz.size):
        scale, spread = modes.scale, modes.spread
        yield [
            str(row + 1),
            number_text(modes.frequency_hz[row]),
            number_text(modes.frequency_std_hz[row]),
            number_text(modes.damping_ratio[row]),
            number_text(modes.damping_std[row]),
            "" if scale is None else number_text(scale.modal_mass[row]),
            "" if scale is None else number_text(scale.modal_mass_std[row]),
            "" if spread is None else str(spread.orders[row]),
            "" if validation is None else number_text(validation.mpc[row]),
            "" if validation is None else number_text(validation.mpd_deg[row]),
            "" if validation is None else number_text(validation.mean_phase_deg[row]),
        ]


def _shape_rows(modes: ModeSet) -> Iterable[list[str]]:
    for row in range(modes.frequency_hz.size):
        start = [str(row + 1), number_text(modes.frequency_hz[row])]
        for column, channel in enumerate(modes.channels):
            component, std = modes.shapes[row, column], modes.shape_std[row, column]
            direction = channel.direction or (float("nan"),) * 3
            yield [
                *start,
                cell_text(channel.name),
                cell_text(channel.point or ""),
                *(number_text(one) for one in direction),
                number_text(component.real),
                number_text(std.real),
                number_text(component.imag),
                number_text(std.imag),
                number_text(abs(component)),
            ]


def write_table(path: Path, columns: Sequence[str], rows: Iterable[list[str]]) -> None:
    """Write a table as RFC 4180 has it, one header line first."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)


def number_text(number: float) -> str:
    """Give a number with all its digits, nothing where it isn't known."""
    return f"{float(number):.17g}" if isfinite(number) else ""
