"""``chladni envelope``: what strikes in a band, and whether it's a bearing."""

from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import NOTHING, number, with_error
from chladni.signals.errors import SetupError
from chladni.signals.text_reading import real_number

if TYPE_CHECKING:
    from chladni.apps.envelope import LogEnvelopes
    from chladni.signals.envelope import EnvelopeSpectrum, FaultLine
    from chladni.spectral.bearings import Bearing

MOST_PEAKS = 5
BEARING_FORM = "elements=N,ball=MM,pitch=MM,angle=DEG"


@opens_files
def envelope(
    log: options.Log,
    *,
    channel: options.Channels = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="LO-HI",
            help="Band of the envelope, in Hz; by kurtogram if not given.",
            show_default=False,
        ),
    ] = None,
    resolution: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Distance of the lines; a quarter of the log a segment if not given."),
    ] = None,
    bearing: Annotated[
        str | None,
        typer.Option(
            metavar=BEARING_FORM, help="Geometry of a bearing; the angle is 0 if not given.", show_default=False
        ),
    ] = None,
    shaft: Annotated[
        float | None, typer.Option(metavar="HZ", help="Revolutions a second of its shaft.", show_default=False)
    ] = None,
    part: options.Part,
    opener: Opener,
    targets: options.Targets,
) -> None:
    """Envelope spectrum in the most impulsive band, with a bearing's frequencies."""
    from chladni.apps.envelope import envelope_document, measure_envelopes
    from chladni.apps.findings import reading_sentences
    from chladni.signals.study import Study

    out = targets.output([log, opener.setup])
    geometry = None if bearing is None else _bearing(bearing)
    with opener(log) as opened, out.progress(log.name) as progress:
        found = measure_envelopes(
            opened,
            channels=channel,
            band_hz=band,
            resolution_hz=resolution,
            bearing=geometry,
            shaft_hz=shaft,
            span=part.span(),
            progress=progress,
        )
        told = reading_sentences(opened, everything=channel is None)
    _print_bands(out, found)
    for one in found.spectra:
        _print_faults(out, one)
    out.lines((*told, *found.notes))
    study = Study(title=log.name, envelopes=found.spectra, findings=(*told, *found.notes))
    out.csv(found.spectra)
    out.pictures(study, figures=targets.figures, report=targets.report)
    out.json(envelope_document, found)


def _bearing(text: str) -> "Bearing":
    from chladni.spectral.bearings import Bearing

    pairs = dict(part.partition("=")[::2] for part in text.split(","))
    known = {"elements", "ball", "pitch", "angle"}
    try:
        values = {name.strip(): real_number(value) for name, value in pairs.items()}
    except ValueError as error:
        raise SetupError(f"--bearing {text!r} is not of the form {BEARING_FORM}: {error}") from error
    if not known - {"angle"} <= values.keys() <= known or values["elements"] != round(values["elements"]):
        raise SetupError(f"--bearing {text!r} is not of the form {BEARING_FORM}")
    return Bearing(
        elements=round(values["elements"]),
        element_diameter=values["ball"],
        pitch_diameter=values["pitch"],
        contact_angle_deg=values.get("angle", 0.0),
    )


def _print_bands(out: Output, found: "LogEnvelopes") -> None:
    out.channel_table(
        "Squared envelopes: band, spectral kurtosis there, and what repeats",
        ["channel", "band [Hz]", "spectral kurtosis", "line spacing [Hz]", "peaks, the highest first [Hz]"],
        [
            [
                one.channel.name,
                f"{number(one.band_hz[0])} to {number(one.band_hz[1])}",
                number(one.band_kurtosis, digits=3),
                number(float(one.frequency_hz[1])),
                ", ".join(with_error(peak.frequency_hz, peak.frequency_std_hz) for peak in one.peaks[:MOST_PEAKS])
                or "-",
            ]
            for one in found.spectra
        ],
    )


def _stands_out(found: "EnvelopeSpectrum", fault: "FaultLine") -> bool:
    """Whether the scatter of the lines doesn't explain a line: it's a peak by name."""
    spacing_hz = float(found.frequency_hz[1])
    return any(abs(peak.frequency_hz - fault.found_hz) <= spacing_hz for peak in found.peaks)


def _print_faults(out: Output, found: "EnvelopeSpectrum") -> None:
    if not found.faults:
        return
    out.table(
        f"{found.channel.name}: a bearing's frequencies",
        ["line", "expected [Hz]", "found [Hz]", "amplitude over the lines around"],
        [
            [
                fault.name,
                number(fault.expected_hz, digits=5),
                number(fault.found_hz, digits=5) if _stands_out(found, fault) else NOTHING,
                number(fault.over_background, digits=3),
            ]
            for fault in found.faults
        ],
    )
