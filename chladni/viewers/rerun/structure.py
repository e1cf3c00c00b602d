"""The structure at rest in three dimensions, and the view of whatever moves in front of it."""

import rerun as rr
import rerun.blueprint as rrb

from chladni.viewers.wireframe import Wireframe

REST_COLOUR = (120, 120, 120)
# More names than this hide the structure; a point still tells its name under the pointer.
NAMES_SHOWN = 24


def draw_rest(recording: rr.RecordingStream, parent: str, wireframe: Wireframe) -> None:
    """Write points with their names, and lines, under ``parent``/rest."""
    size, names = wireframe.size, wireframe.names
    few = len(names) <= NAMES_SHOWN
    grey = [REST_COLOUR] * len(names)
    dots = rr.Points3D(
        wireframe.rest, labels=names, show_labels=False, colors=grey, radii=(0.008 if few else 0.003) * size
    )
    recording.log(f"{parent}/rest/points", dots, static=True)
    # Apart from the points, so that a view too small for names can leave them out.
    shown = rr.Points3D(wireframe.rest, labels=names, show_labels=few, colors=grey, radii=0.0)
    recording.log(f"{parent}/rest/names", shown, static=True)
    strips = [wireframe.rest[list(line)] for line in wireframe.lines]
    wires = rr.LineStrips3D(strips, colors=[REST_COLOUR] * len(strips), radii=0.002 * size)
    recording.log(f"{parent}/rest/lines", wires, static=True)


def shape_view(
    origin: str, name: str, wireframe: Wireframe, *, contents: tuple[str, ...] = (), distance: float = 1.0
) -> rrb.View:
    """Give a view that looks at the structure; all of `origin` unless `contents` says what else.

    The distance is in diagonals of the structure, more or less; a narrow view asks for more.
    """
    eye = rrb.EyeControls3D(
        position=wireframe.centre + wireframe.direction * wireframe.size * distance,
        look_target=wireframe.centre,
        eye_up=(0.0, 0.0, 1.0),
    )
    return rrb.Spatial3DView(
        origin=origin,
        contents=list(contents) or "$origin/**",
        name=name,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
    )
