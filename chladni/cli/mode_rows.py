"""Modes and relative motion as tables for people."""

from typing import TYPE_CHECKING

from chladni.cli.output import Output
from chladni.cli.words import NOTHING, fixed, number, with_error

if TYPE_CHECKING:
    from chladni.signals.mode_set import ModeSet
    from chladni.signals.mode_validation import ModeValidation
    from chladni.signals.relative_motion import RelativeMotion

# As many pairs of neighbours as one reads; all are in the JSON document and the report.
MOST_PAIRS = 3


def print_modes(out: Output, modes: "ModeSet", validation: "ModeValidation") -> None:
    """Print a table of modes with their error bars."""
    out.line(modes.provenance.estimator + (f" from {_sources(modes)}" if modes.references else ""), style="bold")
    if not modes.frequency_hz.size:
        # The findings begin with it, and say why.
        return
    out.channel_table(
        _title(modes),
        ["mode", "frequency [Hz]", "damping ratio [%]", "MPC", "greatest at", *_scale_column(modes)],
        [
            [
                str(row + 1),
                with_error(float(modes.frequency_hz[row]), float(modes.frequency_std_hz[row])),
                with_error(100 * float(modes.damping_ratio[row]), 100 * float(modes.damping_std[row])),
                fixed(float(validation.mpc[row]), places=3),
                modes.channels[int(abs(modes.shapes[row]).argmax())].name,
                *_scale_cell(modes, row),
            ]
            for row in range(modes.frequency_hz.size)
        ],
        named=4,
    )


def _title(modes: "ModeSet") -> str:
    from chladni.modal.shapes.mode_words import synthesised_from

    count = modes.frequency_hz.size
    told = f"{count} mode{'s' if count != 1 else ''}"
    if modes.fit is None:
        return told
    return f"{told}; the synthesis of {synthesised_from(modes)} is {modes.fit.error:.2%} from the measured functions"


def _sources(modes: "ModeSet") -> str:
    names = ", ".join(channel.name for channel in modes.references)
    return f"responses over {names}"


def _scale_column(modes: "ModeSet") -> list[str]:
    return ["modal mass [kg]"] if modes.scale is not None else []


def _scale_cell(modes: "ModeSet", row: int) -> list[str]:
    if modes.scale is None:
        return []
    return [with_error(float(modes.scale.modal_mass[row]), float(modes.scale.modal_mass_std[row]))]


def print_relative_motion(out: Output, modes: "ModeSet", motions: "tuple[RelativeMotion, ...]") -> None:
    """Print the neighbours that move most against each other in each mode."""
    rows = [
        [f"{modes.frequency_hz[row]:.5g}", " - ".join(one.between), _ratio(one), *_gains(one)]
        for row in range(modes.frequency_hz.size)
        for one in [motion for motion in motions if motion.mode == row and motion.ratio is not None][:MOST_PAIRS]
    ]
    if not rows:
        return
    gains = ["damping gain [1/(N s/m)]", "stiffness gain [Hz/(N/m)]"] if modes.scale is not None else []
    out.table(
        f"Motion between neighbours over the greatest of the mode, the {MOST_PAIRS} greatest",
        ["mode [Hz]", "between", "ratio", *gains],
        [row[: 3 + len(gains)] for row in rows],
    )


def _ratio(motion: "RelativeMotion") -> str:
    if motion.ratio is None:
        return NOTHING
    return with_error(motion.ratio, motion.ratio_std or 0.0)


def _gains(motion: "RelativeMotion") -> list[str]:
    return [number(motion.damping_gain), number(motion.stiffness_gain_hz)]
