"""A study drawn into a recording."""

import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.study import Study
from chladni.signals.visible import visible
from chladni.viewers.mode_tables import has_mac, hertz, mode_title
from chladni.viewers.panels import panels
from chladni.viewers.rerun.blueprint import ChannelViews, ModesViews, ModeViews, ResponseViews, Views, arrange
from chladni.viewers.rerun.complexity import draw_complexity
from chladni.viewers.rerun.findings import draw_findings
from chladni.viewers.rerun.frf import draw_coherence, draw_magnitude, draw_phase
from chladni.viewers.rerun.mac import draw_mac
from chladni.viewers.rerun.mode_text import draw_mode_text
from chladni.viewers.rerun.nyquist import draw_nyquist
from chladni.viewers.rerun.ods import draw_deflections
from chladni.viewers.rerun.psd import draw_densities
from chladni.viewers.rerun.shapes import draw_shapes
from chladni.viewers.rerun.spectrum import draw_spectra
from chladni.viewers.rerun.stabilisation import draw_stabilisation
from chladni.viewers.rerun.synthesis import draw_synthesis
from chladni.viewers.rerun.waterfall import draw_waterfalls
from chladni.viewers.rerun.waveforms import draw_waveforms, waveform_view
from chladni.viewers.style import Style

APPLICATION = "chladni"


def new_recording() -> rr.RecordingStream:
    """Open an empty recording; connect it to a file or a viewer before drawing."""
    recording = rr.RecordingStream(APPLICATION)
    # The clock of this computer says nothing about the log; its timelines would only crowd the time panel.
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    return recording


def draw(recording: rr.RecordingStream, study: Study) -> None:
    """Write all of a study and its blueprint into a recording that is connected already.

    Raises
    ------
    ValueError
        From rerun, when a value can't be written; nothing is left out with a mere warning.
    """
    style = Style.of(study)
    recording.send_recording_name(visible(study.title))
    if style.origin_ns:
        recording.send_recording_start_time_nanos(style.origin_ns)
    # Drawing a part also makes its view, so that no view can point at an entity that was renamed.
    views = Views(
        findings=draw_findings(recording, study, style),
        waveforms=draw_waveforms(recording, study, style),
        densities=draw_densities(recording, study, style),
        channels=_draw_over_time(recording, study, style),
        responses=_draw_responses(recording, study, style),
        modes=_draw_modes(recording, study, style),
        pictures=_draw_pictures(recording, study),
    )
    # The blueprint goes last: rerun 0.41 has lost rows that followed one in a file (rerun issue 12769).
    recording.flush()
    recording.send_blueprint(arrange(views), make_active=True, make_default=True)
    recording.flush()


def _draw_pictures(recording: rr.RecordingStream, study: Study) -> list[rrb.View]:
    views: list[rrb.View] = []
    for place, (title, png) in enumerate(study.pictures):
        path = f"/pictures/{place}"
        recording.log(path, rr.EncodedImage(contents=png, media_type="image/png"), static=True)
        views.append(rrb.Spatial2DView(origin=path, name=visible(title)))
    return views


def _draw_over_time(recording: rr.RecordingStream, study: Study, style: Style) -> list[ChannelViews]:
    channels = [channel for waterfall in study.waterfalls for channel in waterfall.channels]
    pictures = zip(
        channels, draw_waterfalls(recording, study, style), draw_spectra(recording, study, style), strict=True
    )
    return [
        ChannelViews(
            label=style.labels[channel.name],
            waveform=waveform_view(study, style, channel.name),
            waterfall=waterfall,
            spectrum=spectrum,
        )
        for channel, waterfall, spectrum in pictures
    ]


def _draw_responses(recording: rr.RecordingStream, study: Study, style: Style) -> list[ResponseViews]:
    response = study.response
    if response is None or not response.excited.any():
        return []
    shapes = draw_deflections(recording, study, response, style)
    return [
        ResponseViews(
            magnitude=draw_magnitude(recording, panel, style),
            phase=draw_phase(recording, panel, style),
            coherence=draw_coherence(recording, panel, style),
            nyquist=draw_nyquist(recording, panel, style),
            deflection=shapes[panel.reference]() if shapes else None,
            label=f"{panel.group.name} to {style.labels[response.references[panel.reference].name]}",
        )
        for panel in panels(response)
    ]


def _draw_modes(recording: rr.RecordingStream, study: Study, style: Style) -> ModesViews | None:
    modes, validation = study.modes, study.validation
    if modes is None:
        return None
    found = modes.frequency_hz.size > 0
    shapes = draw_shapes(recording, study, modes, style) if found else []
    planes = draw_complexity(recording, modes, validation, style) if found else []
    return ModesViews(
        text=draw_mode_text(recording, study, modes, style),
        shapes=[
            ModeViews(
                number=row + 1,
                label=mode_title(modes, row),
                frequency=hertz(float(modes.frequency_hz[row])),
                shape=shape,
                complexity=plane,
            )
            for row, (shape, plane) in enumerate(zip(shapes, planes, strict=True))
        ],
        mac=draw_mac(recording, modes, validation) if validation is not None and has_mac(modes) else None,
        stabilisation=draw_stabilisation(recording, modes),
        synthesis=draw_synthesis(recording, study, modes, style),
    )
