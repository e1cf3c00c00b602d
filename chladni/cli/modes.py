"""``chladni modes``: natural frequencies, damping, modal vectors, relative motion."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.words import NOTHING, number, with_error

if TYPE_CHECKING:
    from chladni.apps.modal_study import ModalStudy
    from chladni.signals.mode_set import ModeSet
    from chladni.signals.mode_validation import ModeValidation
    from chladni.signals.relative_motion import RelativeMotion

MethodName = Literal["plscf", "circle-fit", "half-power", "ssi-cov", "fdd", "efdd"]

# As many pairs of neighbours as one reads; all are in the JSON document and the report.
MOST_PAIRS = 3


def modes(
    log: options.Log,
    *,
    reference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATH", help="Channel of the excitation; a force is taken if not given.", show_default=False
        ),
    ] = None,
    operational: Annotated[
        bool, typer.Option("--operational", help="Use responses alone: the excitation wasn't measured.")
    ] = False,
    channel: Annotated[
        list[str] | None,
        typer.Option(metavar="PATH", help="Only this response; may be repeated.", show_default=False),
    ] = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LO HI", help="Only modes between these frequencies, in Hz.", show_default=False),
    ] = None,
    count: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="At most so many modes.", show_default=False)
    ] = None,
    frequency: Annotated[
        list[float] | None,
        typer.Option(metavar="HZ", help="The mode nearest to this; may be repeated.", show_default=False),
    ] = None,
    method: Annotated[
        MethodName | None,
        typer.Option(help="plscf with an excitation, ssi-cov without, if not given.", show_default=False),
    ] = None,
    resolution: options.Resolution = None,
    start: options.Start = None,
    end: options.End = None,
    setup: options.Setup = None,
    stamp: options.Stamp = "auto",
    json: options.Json = None,
    uff: Annotated[
        Path | None,
        typer.Option(metavar="FILE.uff", help="Write shapes, points and functions as UFF.", show_default=False),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Write modes and shapes as a table.", show_default=False)
    ] = None,
    save: Annotated[
        Path | None, typer.Option(metavar="OUT.rrd", help="Write a rerun recording.", show_default=False)
    ] = None,
    figures: options.Figures = None,
    report: options.Report = None,
) -> None:
    """Natural frequencies, damping ratios and modal vectors, with their uncertainty."""
    from chladni.apps.findings import damage_sentences
    from chladni.apps.modal_study import modal_study
    from chladni.apps.modes import Wanted
    from chladni.apps.modes_document import modes_document
    from chladni.apps.sources import Span
    from chladni.io.log import open_log

    out = Output(json)
    with open_log(log, setup=setup, stamp=stamp) as opened, out.progress(log.name) as progress:
        found = modal_study(
            opened,
            references=reference,
            operational=operational,
            channels=channel,
            method=method,
            wanted=Wanted.of(bands_hz=None if band is None else [band], count=count, frequencies_hz=frequency),
            resolution_hz=resolution,
            span=Span(start_s=start, end_s=end),
            progress=progress,
        )
        damage = damage_sentences(opened.damage)
    motions = found.study.relative_motion
    _print_modes(out, found.modes, found.validation)
    _print_relative_motion(out, found.modes, motions)
    out.lines(damage + found.study.findings)
    _write(out, found, uff=uff, csv=csv, save=save)
    out.pictures(found.study, figures=figures, report=report)
    out.json(modes_document(found.modes, found.validation, motions))


def _print_modes(out: Output, modes: "ModeSet", validation: "ModeValidation") -> None:
    out.line(modes.provenance.estimator + (f" from {_sources(modes)}" if modes.references else ""), style="bold")
    if not modes.frequency_hz.size:
        out.line("No mode was found.")
        return
    out.table(
        _title(modes),
        ["mode", "frequency [Hz]", "damping ratio [%]", "MPC", "greatest at", *_scale_column(modes)],
        [
            [
                str(row + 1),
                with_error(float(modes.frequency_hz[row]), float(modes.frequency_std_hz[row])),
                with_error(100 * float(modes.damping_ratio[row]), 100 * float(modes.damping_std[row])),
                f"{validation.mpc[row]:.3f}",
                modes.channels[int(abs(modes.shapes[row]).argmax())].name,
                *_scale_cell(modes, row),
            ]
            for row in range(modes.frequency_hz.size)
        ],
    )


def _title(modes: "ModeSet") -> str:
    count = modes.frequency_hz.size
    told = f"{count} mode{'s' if count != 1 else ''}"
    if modes.fit is None:
        return told
    return f"{told}; the synthesis is {modes.fit.error:.2%} from the measured functions"


def _sources(modes: "ModeSet") -> str:
    names = ", ".join(channel.name for channel in modes.references)
    return f"responses over {names}"


def _scale_column(modes: "ModeSet") -> list[str]:
    return ["modal mass [kg]"] if modes.scale is not None else []


def _scale_cell(modes: "ModeSet", row: int) -> list[str]:
    if modes.scale is None:
        return []
    return [with_error(float(modes.scale.modal_mass[row]), float(modes.scale.modal_mass_std[row]))]


def _print_relative_motion(out: Output, modes: "ModeSet", motions: "tuple[RelativeMotion, ...]") -> None:
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


def _write(out: Output, found: "ModalStudy", *, uff: Path | None, csv: Path | None, save: Path | None) -> None:
    if uff is not None:
        from chladni.io.files.uff_modes import write_uff_modes

        out.lines(write_uff_modes(uff, found.modes, geometry=found.study.geometry, response=found.study.response))
        out.line(f"universal file: {uff}")
    if csv is not None:
        from chladni.io.files.modes_table import write_modes_csv

        for path in write_modes_csv(csv, found.modes, validation=found.validation):
            out.line(f"table: {path}")
    if save is not None:
        from chladni.viewers.rerun import write_rrd

        out.line(f"recording: {write_rrd(found.study, save)}")
