"""``chladni tolerance``: whether a random test keeps its profile."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import NOTHING, number
from chladni.signals.unit_text import with_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chladni.apps.tolerance import Tolerated

PERCENT = 100


@opens_files
def tolerance(
    log: options.Log,
    breakpoints: Annotated[
        list[str],
        typer.Argument(
            metavar="HZ:DENSITY...", help="The profile's breakpoints, such as 20:0.01 80:0.04.", show_default=False
        ),
    ],
    *,
    unit: Annotated[str, typer.Option(metavar="UNIT", help="Densities are in this, squared, a Hz.")] = "g",
    upper: Annotated[float, typer.Option(metavar="DB", help="How far above the profile is allowed.")] = 3.0,
    lower: Annotated[float, typer.Option(metavar="DB", help="How far below it.")] = 3.0,
    channel: options.Channels = None,
    resolution: options.Resolution = None,
    start: options.Start = None,
    end: options.End = None,
    opener: Opener,
    json: options.Json = None,
    figures: options.Figures = None,
) -> None:
    """Spectra of a random vibration test against its profile and tolerance."""
    from chladni.apps.documents import tolerance_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.sources import Span
    from chladni.apps.spectra import Averaging
    from chladni.apps.tolerance import tolerated
    from chladni.spectral.random_vibration import random_profile

    out = Output.of_log([log, opener.setup], json=json, figures=figures)
    profile = random_profile([*map(_point, breakpoints)], unit=unit, upper_db=upper, lower_db=lower)
    with opener(log) as opened, out.progress(log.name) as progress:
        found = tolerated(
            opened,
            profile,
            channels=channel,
            averaging=Averaging(resolution_hz=resolution),
            span=Span(start_s=start, end_s=end),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    _print_checks(out, found, unit)
    out.lines((*told, *(note for one in found for note in (*one.notes, *one.density.provenance.notes))))
    if figures is not None:
        _save_figures(out, found, unit, figures)
    out.json(tolerance_document, found)


def _point(text: str) -> tuple[float, float]:
    from chladni.signals.errors import SetupError
    from chladni.signals.text_reading import real_number

    frequency, _, density = text.partition(":")
    try:
        return real_number(frequency), real_number(density)
    except ValueError:
        raise SetupError(f"breakpoint {text!r} is not of the form HZ:DENSITY, such as 20:0.01") from None


def _print_checks(out: Output, found: "Sequence[Tolerated]", unit: str) -> None:
    from chladni.signals.units import si_factor

    factor, _ = si_factor(unit)
    profile = found[0].check.profile
    out.channel_table(
        f"Profile of {with_unit(number(profile.rms() / factor), unit)} RMS, +{number(profile.upper_db)} -"
        f"{number(profile.lower_db)} dB",
        ["channel", "RMS", "unit", "lines outside [%]", "highest [dB]", "at [Hz]", "lowest [dB]", "at [Hz]",
         "one sigma [dB]"],
        [_row(one, row, factor, unit) for one in found for row in range(len(one.check.channels))],
    )  # fmt: skip


def _row(one: "Tolerated", row: int, factor: float, unit: str) -> list[str]:
    check = one.check
    deviation = check.deviation_db[row]
    high, low = int(deviation.argmax()), int(deviation.argmin())
    return [
        check.channels[row].name,
        number(float(check.rms[row]) / factor),
        NOTHING if unit == "1" else unit,
        number(PERCENT * float(check.outside[row]), digits=3),
        f"{deviation[high]:+.1f}",
        number(float(check.frequency_hz[high])),
        f"{deviation[low]:+.1f}",
        number(float(check.frequency_hz[low])),
        f"{check.std_db[row]:.1f}",
    ]


def _save_figures(out: Output, found: "Sequence[Tolerated]", unit: str, folder: Path) -> None:
    from chladni.viewers.figures.random_vibration import tolerance_figures

    drawn = tolerance_figures([one.density for one in found], found[0].check.profile, unit=unit)
    out.figures("tolerance", drawn, folder)
