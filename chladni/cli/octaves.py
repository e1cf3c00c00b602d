"""``chladni octaves``: levels in octave bands."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number

if TYPE_CHECKING:
    from chladni.signals.levels import OctaveLevels


@opens_files
def octaves(
    log: options.Log,
    *,
    channel: options.Channels = None,
    fraction: Annotated[int, typer.Option(metavar="N", min=1, max=24, help="Bands in an octave: 1, 3, 12, ...")] = 3,
    weighting: Annotated[
        Literal["A", "C"] | None,
        typer.Option(help="Weighting of sound level meters, for microphones.", show_default=False),
    ] = None,
    low: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Begin here; as low as the record allows if not given.", show_default=False),
    ] = None,
    part: options.Part,
    opener: Opener,
    targets: options.Targets,
) -> None:
    """Levels in octaves, third octaves, or finer bands, after IEC 61260-1."""
    from chladni.apps.findings import reading_sentences
    from chladni.apps.octaves import measure_octaves, octaves_document
    from chladni.signals.study import Study

    out = targets.output([log, opener.setup])
    with opener(log) as opened, out.progress(log.name) as progress:
        found = measure_octaves(
            opened,
            channels=channel,
            fraction=fraction,
            weighting=weighting,
            low_hz=low,
            span=part.span(),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    for one in found.octaves:
        _print_bands(out, one)
    out.lines((*told, *found.notes))
    study = Study(title=log.name, octaves=found.octaves, findings=(*told, *found.notes))
    out.csv(found.octaves)
    out.pictures(study, figures=targets.figures, report=targets.report)
    out.json(octaves_document, found)


def _print_bands(out: Output, found: "OctaveLevels") -> None:
    from chladni.signals.channel import labels_of
    from chladni.signals.levels import decibels
    from chladni.spectral.octaves import name_of
    from chladni.viewers.groups import groups

    labels = labels_of(found.channels)
    weighted = f", {found.weighting}-weighted" if found.weighting else ""
    in_decibels, totals = found.decibels(), decibels(found.total, found.channels)
    for group in groups(found.channels):
        sound = group.unit == "Pa"
        levels, total = (in_decibels, totals) if sound else (found.bands.rms, found.total)
        rows = [[f"{hz:g}", *levels[list(group.rows), band]] for band, hz in enumerate(found.nominal_hz)]
        rows.append(["all", *total[list(group.rows)]])
        measure = "dB over 20 uPa" if sound else f"RMS in {group.unit}"
        digits = "{:.1f}".format if sound else number
        out.table(
            f"Levels in {name_of(found.fraction)} bands{weighted}, {measure}",
            ["band [Hz]", *(labels[found.channels[row].name] for row in group.rows)],
            [[first, *(digits(float(one)) for one in rest)] for first, *rest in rows],
        )
