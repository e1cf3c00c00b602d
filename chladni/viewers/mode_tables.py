"""Modes in words: titles of pictures, and rows of the tables that the report and rerun show."""

from collections import Counter
from collections.abc import Collection, Sequence
from math import isfinite

from chladni.signals.arrays import Real
from chladni.signals.channel_labels import LONGEST_NAME
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.relative_motion import RelativeMotion
from chladni.signals.study import Study
from chladni.signals.wording import with_sigma
from chladni.viewers.style import Style

Row = tuple[str, ...]


def hertz(frequency_hz: float) -> str:
    """Print a natural frequency with four digits, but without powers of ten.

    Examples
    --------
    >>> hertz(24.672), hertz(12345.6), hertz(100.0)
    ('24.67', '12346', '100.0')
    """
    if frequency_hz >= 1000:
        return f"{frequency_hz:.0f}"
    # Trailing zeros stay: they say how well the frequency is known, and columns of numbers stay aligned.
    return f"{frequency_hz:#.4g}".rstrip(".")


def mode_title(modes: ModeSet, row: int) -> str:
    """Name a mode by number, natural frequency and damping ratio, such as ``1: 24.67 Hz, 1.02 %``."""
    return f"{row + 1}: {hertz(float(modes.frequency_hz[row]))} Hz, {modes.damping_ratio[row] * 100:.2f} %"


def has_mac(modes: ModeSet) -> bool:
    """Whether likeness of shapes tells anything: one mode is like itself, and one channel has one shape."""
    return modes.frequency_hz.size > 1 and len(modes.channels) > 1


def mode_ticks(modes: ModeSet) -> tuple[str, ...]:
    """Name the modes as ticks of an axis: number and natural frequency."""
    return tuple(f"{row + 1}: {hertz(float(hz))}" for row, hz in enumerate(modes.frequency_hz))


def mode_table(modes: ModeSet, validation: ModeValidation | None) -> tuple[Row, list[Row]]:
    """Give headings and rows: number, frequency and damping with one sigma, phase collinearity, modal mass.

    A single channel has one component in each shape, and no phase to compare.
    """
    columns: list[tuple[str, list[str]]] = [
        ("Mode", [str(row + 1) for row in range(modes.frequency_hz.size)]),
        ("Frequency [Hz]", _estimates(modes.frequency_hz, modes.frequency_std_hz)),
        ("Damping [%]", _estimates(modes.damping_ratio * 100, modes.damping_std * 100)),
    ]
    if validation is not None and len(modes.channels) > 1:
        columns += [
            ("MPC", [f"{value:.3f}" for value in validation.mpc]),
            ("MPD [deg]", [f"{value:.1f}" for value in validation.mpd_deg]),
        ]
    if modes.scale is not None:
        masses = _estimates(modes.scale.modal_mass, modes.scale.modal_mass_std)
        columns.append((f"Modal mass{_mass_unit(modes)}", masses))
    if modes.spread is not None:
        columns.append(("Orders", [str(count) for count in modes.spread.orders]))
    return tuple(heading for heading, _ in columns), list(zip(*(texts for _, texts in columns), strict=True))


def motion_table(motions: Sequence[RelativeMotion], modes: ModeSet, style: Style) -> tuple[Row, list[Row]]:
    """Give headings and rows of relative motion, mode by mode, the greatest ratio of each mode first.

    There is no row at all when no two neighbours have a common direction: a page of blanks says nothing.
    """
    scaled = any(motion.damping_gain is not None or motion.stiffness_gain_hz is not None for motion in motions)
    headings: Row = ("Mode", "Frequency [Hz]", "Between", "Ratio")
    if scaled:
        headings += ("Δζ [% per N s/m]", "Δf [Hz per N/m]")
    rows: list[Row] = []
    if all(motion.ratio is None for motion in motions):
        return headings, rows
    for motion in sorted(motions, key=_mode_then_ratio):
        ratio = "no common direction" if motion.ratio is None else _estimate(motion.ratio, motion.ratio_std)
        row: Row = (
            str(motion.mode + 1),
            hertz(float(modes.frequency_hz[motion.mode])),
            between(motion, style),
            ratio,
        )
        rows.append((*row, *_gains(motion)) if scaled else row)
    return headings, rows


def first_of_each(rows: Sequence[Row], count: int) -> list[Row]:
    """Keep the first rows of each mode, which the first column tells.

    Examples
    --------
    >>> first_of_each([("1", "a"), ("1", "b"), ("2", "c")], 1)
    [('1', 'a'), ('2', 'c')]
    """
    seen: Counter[str] = Counter()
    kept = []
    for row in rows:
        seen[row[0]] += 1
        if seen[row[0]] <= count:
            kept.append(row)
    return kept


def between(motion: RelativeMotion, style: Style, *, longest: int = LONGEST_NAME) -> str:
    """Name the two that move against each other, each with at most so many characters."""
    # A channel that stands for a point goes by its label.
    return " – ".join(_shortened(style.labels.get(name, name), longest) for name in motion.between)


def advice(study: Study, modes: ModeSet, *, told: Collection[str] = ()) -> list[str]:
    """Give what must be known before the modes are relied upon: findings, machine lines, notes of the method.

    Sentences that are `told` elsewhere in the same place, and notes that came with the frequency responses and stand
    beside those, are not repeated.
    """
    findings = [] if study.validation is None else list(study.validation.findings)
    harmonics = [f"{hertz(line.frequency_hz)} Hz is no mode: {line.reason}" for line in modes.harmonics]
    inherited = () if study.response is None else study.response.provenance.notes
    sentences = dict.fromkeys([*findings, *harmonics, *modes.provenance.notes])
    return [sentence for sentence in sentences if sentence not in told and sentence not in inherited]


def _shortened(name: str, longest: int) -> str:
    # The ends tell names apart more often than the middle does.
    return name if len(name) <= longest else f"{name[: longest // 2 - 1]}…{name[-(longest // 2) :]}"


def _mode_then_ratio(motion: RelativeMotion) -> tuple[int, float]:
    return motion.mode, -(motion.ratio if motion.ratio is not None else -1.0)


def _gains(motion: RelativeMotion) -> Row:
    damping = "" if motion.damping_gain is None else f"{motion.damping_gain * 100:.3g}"
    stiffness = "" if motion.stiffness_gain_hz is None else f"{motion.stiffness_gain_hz:.3g}"
    return damping, stiffness


def _mass_unit(modes: ModeSet) -> str:
    """Kilograms where the driving point is a force and a translation; else the scale has another unit."""
    units = {channel.name: channel.unit for channel in (*modes.channels, *modes.references)}
    scale = modes.scale
    translations = {"m/s^2", "m/s", "m"}
    if scale is not None and units.get(scale.reference) == "N" and units.get(scale.response) in translations:
        return " [kg]"
    return ""


def _estimates(values: Real, deviations: Real) -> list[str]:
    return [_estimate(float(value), float(std)) for value, std in zip(values, deviations, strict=True)]


def _estimate(value: float, deviation: float | None) -> str:
    return with_sigma(value, deviation) if deviation is not None and isfinite(deviation) else f"{value:.4g}"
