"""Where the measurement points sit and which of them are joined by lines."""

from collections import Counter
from dataclasses import dataclass

from chladni.signals.channel import Vector
from chladni.signals.errors import SetupError


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A named measurement point; `position` in metres."""

    name: str
    position: Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """Measurement points and the wireframe between them.

    Attributes
    ----------
    points
        In the order of the setup file, names unique.
    lines
        Each a sequence of point names, drawn as one stroke.
    """

    points: tuple[Point, ...] = ()
    lines: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        names = Counter(point.name for point in self.points)
        for name, count in names.items():
            if count > 1:
                raise SetupError(f"point {name!r} is defined {count} times; point names are unique")
        for line in self.lines:
            for name in line:
                if name not in names:
                    raise SetupError(f"a line goes through {name!r}, which is no point; points: {', '.join(names)}")

    def position(self, name: str) -> Vector:
        """Position of the named point in metres; `SetupError` when there is no such point."""
        for point in self.points:
            if point.name == name:
                return point.position
        raise SetupError(f"no point {name!r}; points: {', '.join(point.name for point in self.points) or 'none'}")
