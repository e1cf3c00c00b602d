"""``chladni modes``: natural frequencies, damping, modal vectors, relative motion."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from chladni.cli import options
from chladni.cli.mode_rows import print_modes, print_relative_motion
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.signals.errors import SetupError

if TYPE_CHECKING:
    from chladni.apps.modal_study import ModalStudy
    from chladni.apps.modes import Wanted
    from chladni.apps.picking import ModePicking
    from chladni.io.log import Log as OpenedLog

_Band = Annotated[
    tuple[float, float] | None,
    typer.Option(metavar="LO-HI", help="Only modes between these frequencies, in Hz.", show_default=False),
]
_Fmax = Annotated[
    float | None,
    typer.Option("--fmax", metavar="HZ", help="Only modes below this frequency.", show_default=False),
]
_Uff = Annotated[
    Path | None,
    typer.Option(metavar="FILE.uff", help="Write shapes, points and functions as UFF.", show_default=False),
]
MethodName = Literal["plscf", "circle-fit", "half-power", "ssi-cov", "fdd", "efdd"]


@opens_files
def modes(
    log: options.Log,
    *,
    reference: options.References = None,
    operational: Annotated[
        bool, typer.Option("--operational", help="Use responses alone: the excitation wasn't measured.")
    ] = False,
    channel: options.Channels = None,
    band: _Band = None,
    fmax: _Fmax = None,
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
    pick: Annotated[
        bool, typer.Option("--pick", help="Click the modes in the stabilisation chart, in the browser.")
    ] = False,
    port: Annotated[int, typer.Option(metavar="N", help="Port of that page; 0 takes a free one.")] = 0,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="Open that page in the browser.")] = True,
    resolution: options.Resolution = None,
    part: options.Part,
    join: options.Join = "auto",
    opener: Opener,
    unit: options.Unit = None,
    looks: options.Looks,
    targets: options.Targets,
    uff: _Uff = None,
    save: Annotated[
        Path | None, typer.Option(metavar="OUT.rrd", help="Write a rerun recording.", show_default=False)
    ] = None,
) -> None:
    """Natural frequencies, damping ratios and modal vectors, with their uncertainty."""
    from chladni.apps.modal_study import modal_study
    from chladni.apps.modes import Wanted
    from chladni.signals.shown_units import require_units

    out = targets.output([log, opener.setup], looks, others={"--uff": uff, "--save": save})
    asked = _below(band, fmax)
    wanted = Wanted.of(bands_hz=None if asked is None else [asked], count=count, frequencies_hz=frequency)
    given: dict[str, Any] = {
        "references": reference, "operational": operational, "channels": channel, "method": method,
        "resolution_hz": resolution, "span": part.span(join=join),
    }  # fmt: skip
    with opener(log) as opened:
        require_units(opened.channels, unit)
        if pick:
            picking = _picking(out, opened, wanted=wanted, **given)
            wanted = _kept(out, picking, wanted, port=port, open_page=open_page)
        with out.progress(log.name) as progress:
            found = modal_study(opened, wanted=wanted, progress=progress, **given).drawn_in(unit)
    print_modes(out, found.modes, found.validation)
    print_relative_motion(out, found.modes, found.study.relative_motion)
    out.lines(found.study.findings)
    _write(out, found, targets, looks, uff=uff, save=save)


def _below(band: tuple[float, float] | None, fmax: float | None) -> tuple[float, float] | None:
    if fmax is None:
        return band
    low_hz, high_hz = band or (0.0, fmax)
    if not fmax > low_hz:
        raise SetupError(f"--fmax {fmax:g} leaves no frequency; give one above {low_hz:g} Hz")
    return low_hz, min(high_hz, fmax)


def _picking(out: Output, log: "OpenedLog", **given: Any) -> "ModePicking":
    from chladni.apps.modal_study import picking_study

    with out.progress(log.path.name) as progress:
        return picking_study(log, progress=progress, **given)


def _kept(out: Output, picking: "ModePicking", wanted: "Wanted", *, port: int, open_page: bool) -> "Wanted":
    """Serve the page until the selection is kept, and ask for just these modes."""
    from dataclasses import replace

    from chladni.apps.picking import open_picking

    server = open_picking(picking, port=port)

    def tell() -> None:
        out.line(f"{server.address}modes")
        out.line("Only this computer can reach this address. Keep the modes there, or end with Ctrl-C.")
        if open_page:
            import webbrowser

            webbrowser.open(f"{server.address}modes")

    server.run(tell)
    listed = " ".join(f"--frequency {one:g}" for one in picking.frequencies_hz)
    out.line(f"The same modes again: {listed}")
    return replace(wanted, count=None, frequencies_hz=picking.frequencies_hz)


def _write(
    out: Output,
    found: "ModalStudy",
    targets: options.Targets,
    looks: options.Looks,
    *,
    uff: Path | None,
    save: Path | None,
) -> None:
    from chladni.apps.modes_document import modes_document

    if uff is not None:
        from chladni.io.files.uff_modes import write_uff_modes

        out.lines(write_uff_modes(uff, found.modes, geometry=found.study.geometry, response=found.study.response))
        out.line(f"universal file: {uff}")
    out.csv([found.modes] if out.csv_streams else [found.modes, found.validation])
    if save is not None:
        from chladni.viewers.rerun import write_rrd

        out.line(f"recording: {write_rrd(found.study, save)}")
    out.pictures(found.study, figures=targets.figures, report=targets.report, looks=looks)
    motions, passed_on = found.study.relative_motion, found.transmissibility
    out.json(modes_document, found.modes, found.validation, motions, passed_on)
