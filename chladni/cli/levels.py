"""``chladni levels``: how strong, how peaked, how severe."""

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options, words
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, with_error

if TYPE_CHECKING:
    from chladni.signals.levels import Levels, Severity

MachineName = Literal["large-rigid", "large-flexible", "medium-rigid", "medium-flexible"]


@opens_files
def levels(
    log: options.Log,
    *,
    channel: options.Channels = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LO-HI", help="Levels between these frequencies, in Hz.", show_default=False),
    ] = None,
    running: Annotated[
        float | None,
        typer.Option(metavar="S", help="Windows of running levels; 0.125 s if not given.", show_default=False),
    ] = None,
    machine: Annotated[
        MachineName | None,
        typer.Option(
            help="Class and foundation, for the zone of ISO 20816-3; large is above 300 kW.", show_default=False
        ),
    ] = None,
    slow: Annotated[
        bool, typer.Option("--slow", help="The machine turns slower than 600 r/min: severity from 2 Hz on.")
    ] = False,
    unit: options.Unit = None,
    part: options.Part,
    opener: Opener,
    targets: options.Targets,
) -> None:
    """RMS, peak, crest factor, skewness, kurtosis, and vibration severity in mm/s."""
    from chladni.apps.findings import reading_sentences
    from chladni.apps.levels import levels_document, measure_levels
    from chladni.signals.shown_units import all_in_units, require_units
    from chladni.signals.study import Study

    out = targets.output([log, opener.setup])
    with opener(log) as opened, out.progress(log.name) as progress:
        require_units(opened.channels, unit)
        measured = measure_levels(
            opened,
            channels=channel,
            bands_hz=None if band is None else [band],
            running_s=running,
            machine=machine,
            slow=slow,
            span=part.span(),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    found = replace(measured, levels=all_in_units(measured.levels, unit))
    for one in found.levels:
        _print_levels(out, one)
    for judged in found.severities:
        _print_severity(out, judged)
    if found.severities and machine is None:
        out.lines(("no zone of severity is told: it needs the machine's class (--machine)",))
    if not found.severities and machine is not None and not any("no severity" in note for note in found.notes):
        out.lines(("no severity is told: no channel is in m/s^2 or m/s; state the units in a setup file (--setup)",))
    findings = (*told, *found.notes)
    out.lines(findings)
    out.csv([*found.levels, *found.severities])
    study = Study(title=log.name, levels=found.levels, severities=found.severities, findings=findings)
    out.pictures(study, figures=targets.figures, report=targets.report)
    out.json(levels_document, found)


def _print_levels(out: Output, found: "Levels") -> None:
    for column, (low_hz, high_hz) in enumerate(found.bands_hz):
        out.channel_table(
            f"Levels about the mean, {number(low_hz)} to {number(high_hz)} Hz",
            ["channel", "RMS", "unit", "mean", "peak", "peak to peak", "crest factor", "skewness", "kurtosis"],
            [
                [
                    channel.name,
                    with_error(float(found.rms[row, column]), float(found.rms_std[row, column])),
                    words.unit(channel.unit),
                    *(
                        number(float(one[row, column]))
                        for one in (
                            found.mean,
                            found.peak,
                            found.peak_to_peak,
                            found.crest_factor,
                            found.skewness,
                            found.kurtosis,
                        )
                    ),
                ]
                for row, channel in enumerate(found.channels)
            ],
        )


def _print_severity(out: Output, found: "Severity") -> None:
    zoned = ["zone", "by"] if found.zones else []
    low_hz, high_hz = map(number, found.band_hz)
    by = ""
    if found.zones:
        by = f", zones of ISO 20816-3 for {found.machine}: {_limits(found.boundaries_mm_s)} mm/s"
        by += f"; {_limits(found.boundaries_um)} um"
    out.channel_table(
        f"Vibration severity from {low_hz} to {high_hz} Hz{by}",
        ["channel", "velocity RMS [mm/s]", "displacement RMS [um]", *zoned],
        [
            [
                channel.name,
                with_error(float(found.velocity_mm_s[row]), float(found.velocity_std_mm_s[row])),
                with_error(float(found.displacement_um[row]), float(found.displacement_std_um[row])),
                *_judged(found, row),
            ]
            for row, channel in enumerate(found.channels)
        ],
    )


def _limits(boundaries: tuple[float, ...]) -> str:
    return ", ".join(f"{pair} {one:g}" for pair, one in zip(("A/B", "B/C", "C/D"), boundaries, strict=True))


def _judged(found: "Severity", row: int) -> list[str]:
    """Give the zone, and the severer criterion that it's told by."""
    if not found.zones:
        return []
    velocity, displacement = found.velocity_zones[row], found.displacement_zones[row]
    both = "both" if velocity == displacement else "velocity" if velocity > displacement else "displacement"
    return [found.zones[row], both]
