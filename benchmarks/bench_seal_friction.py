"""Friction of pneumatic seals over pressure: what the logs give, and what they predict of samples not fitted.

The three logs of a 3-D printed cylinder hold time, position, pressure and force. Columns are read with the
time stamps as they are: those of the 4 bar log have no single rate, so it isn't read as a uniform series. Only the
difference of two stamps is used, as the length of a step.
"""

import itertools
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chladni.models.core.port_law import PortLaw
from chladni.models.drives.seal_friction import seal_friction_force
from chladni.models.effects.hysteresis import bouc_wen
from chladni.models.integrator.known_motion import force_along_motion
from chladni.signals.arrays import Mask, Real, Whole

PRESSURES_BAR = (1, 4, 7)
YIELDS_M = np.geomspace(5e-5, 2e-3, 25)
SMOOTHING = 3
STROKE_M = (5e-3, 30e-3)


@dataclass(frozen=True)
class Log:
    """One pressure: ``[sample]`` of time, position, velocity, pressure, force, and the stroke each belongs to."""

    bar: int
    t: Real
    x: Real
    v: Real
    p: Real
    f: Real
    stroke: Whole

    def loop(self, yield_m: float) -> Real:
        """Bristle of unit force along the motion."""
        law = PortLaw(port=0, function=bouc_wen, parameters=(1.0, yield_m, 1.0), state=(0.0,))
        return force_along_motion(law, self.x, self.v, self.t)


def main() -> None:
    """Print the tables."""
    folder = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    logs = [read(folder / f"pneumatic_seal_{bar}bar.csv", bar) for bar in PRESSURES_BAR]
    area, ambient = area_of(logs)
    bore_mm, absolute = 2e3 * np.sqrt(area / np.pi), -101325 * area
    print(f"Area from force over pressure of all logs: {1e4 * area:.3f} cm², a bore of {bore_mm:.1f} mm;")
    print(f"{ambient:.2f} N remain at zero, where an absolute pressure would leave {absolute:.0f} N.\n")
    fits = [identify(log, area, slice(None)) for log in logs]
    table(logs, fits, area)
    held_out_strokes(logs, area)
    held_out_pressures(logs, fits, area)
    speeds(logs)


def read(path: Path, bar: int) -> Log:
    """Columns of a file: ms, V, V, V, mm, bar, N."""
    columns = np.loadtxt(path).T
    t, x, p, f = 1e-3 * columns[0], 1e-3 * columns[4], 1e5 * columns[5], columns[6]
    # The start of a file is a jump of the clock by a quarter second, in which the press already moves.
    first = int(np.argmax(np.diff(t) > 0.1)) + 1 if np.any(np.diff(t)[:20] > 0.1) else 0
    t, x, p, f = (column[first:] for column in (t, x, p, f))
    x, p = moving_mean(x), moving_mean(p)
    v = np.gradient(x, t)
    direction = np.where(np.abs(v) > 3e-3, np.sign(v), 0.0)
    known = np.flatnonzero(direction)
    direction = direction[known[np.clip(np.searchsorted(known, np.arange(x.size), "right") - 1, 0, None)]]
    return Log(bar=bar, t=t, x=x, v=v, p=p, f=f, stroke=np.cumsum(np.diff(direction, prepend=direction[0]) != 0))


def moving_mean(column: Real) -> Real:
    return np.convolve(np.pad(column, SMOOTHING // 2, "edge"), np.full(SMOOTHING, 1 / SMOOTHING), "valid")


@dataclass(frozen=True)
class Fit:
    """Friction of one log: yield displacement, Coulomb force, offset of the sensors, RMS error."""

    yield_m: float
    level: float
    offset: float
    error: float


def mid_stroke(log: Log, sign: int) -> Mask:
    return (log.x > STROKE_M[0]) & (log.x < STROKE_M[1]) & (sign * log.v > 3e-3)


def area_of(logs: list[Log]) -> tuple[float, float]:
    """Slope and intercept of force over pressure, the mean of both directions."""
    means = [[np.mean([c[mid_stroke(log, s)].mean() for s in (1, -1)]) for c in (log.p, log.f)] for log in logs]
    slope, intercept = np.polyfit(*np.array(means).T, 1)
    return float(slope), float(intercept)


def identify(log: Log, area: float, part: slice) -> Fit:
    """Least squares of force minus pressure times area, on a part of the samples."""
    fits = []
    for yield_m in YIELDS_M:
        columns = np.column_stack([log.loop(float(yield_m)), np.ones(log.f.size)])[part]
        force = (log.f - area * log.p)[part]
        level, offset = np.linalg.lstsq(columns, force, rcond=None)[0]
        error = np.sqrt(np.mean((force - columns @ (level, offset)) ** 2))
        fits.append(Fit(float(yield_m), float(level), float(offset), float(error)))
    return min(fits, key=lambda fit: fit.error)


def friction_of(log: Log, fit: Fit, area: float) -> Real:
    return log.f - area * log.p - fit.offset


def stroke_levels(log: Log, friction: Real) -> Real:
    """Half the difference of the mean friction of each stroke and the one after it, mid-stroke."""
    inside = (log.x > STROKE_M[0]) & (log.x < STROKE_M[1])
    numbers = [stroke for stroke in np.unique(log.stroke) if np.count_nonzero(inside & (log.stroke == stroke)) > 50]
    means = np.array([friction[inside & (log.stroke == stroke)].mean() for stroke in numbers])
    return np.abs(np.diff(means)) / 2


def place_levels(log: Log, friction: Real) -> Real:
    """Half the difference of both directions in ten parts of the stroke."""
    edges = np.linspace(*STROKE_M, 11)
    halves = []
    for low, high in itertools.pairwise(edges):
        inside = (log.x >= low) & (log.x < high)
        halves.append((friction[inside & (log.v > 0)].mean() - friction[inside & (log.v < 0)].mean()) / 2)
    return np.array(halves)


def table(logs: list[Log], fits: list[Fit], area: float) -> None:
    print(
        "| pressure [bar] | Coulomb [N] | sigma over strokes | sigma along the stroke | yield [mm] | offset [N] |",
        end="",
    )
    print(" shipped line [N] | RMS error [N] | of RMS friction |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for log, fit in zip(logs, fits, strict=True):
        friction = friction_of(log, fit, area)
        value, std = seal_friction_force(log.p.mean())
        print(
            f"| {log.bar} | {fit.level:.2f} | {stroke_levels(log, friction).std():.2f} | "
            f"{place_levels(log, friction).std():.2f} | {1e3 * fit.yield_m:.2f} | {fit.offset:.2f} | "
            f"{value:.2f} ± {std:.2f} | {fit.error:.2f} | {100 * fit.error / np.sqrt(np.mean(friction**2)):.0f} % |"
        )
    line = np.polyfit([log.p.mean() / 1e5 for log in logs], [fit.level for fit in fits], 1)
    print(f"\nStraight line through the three: {line[1]:.2f} N + {line[0]:.3f} N/bar.\n")


def held_out_strokes(logs: list[Log], area: float) -> None:
    """First half of each log fitted, second half predicted."""
    print("Held out, second half of the strokes of each log:\n")
    print(
        "| pressure [bar] | RMS error [N] | of RMS friction | without friction [N] |\n| ---: | ---: | ---: | ---: |"
    )
    for log in logs:
        half = log.f.size // 2
        fit = identify(log, area, slice(0, half))
        report(log.bar, friction_of(log, fit, area)[half:], fit.level * log.loop(fit.yield_m)[half:])


def held_out_pressures(logs: list[Log], fits: list[Fit], area: float) -> None:
    """Two pressures fitted, the third predicted by the straight line through both, with their mean yield."""
    print("\nHeld out, one pressure, from the line through the other two (offset of its sensors its own):\n")
    print(
        "| pressure [bar] | Coulomb predicted, found [N] | RMS error [N] | of RMS friction | without friction [N] |"
    )
    print("| ---: | ---: | ---: | ---: | ---: |")
    for left, log in enumerate(logs):
        kept = [place for place in range(len(logs)) if place != left]
        line = np.polyfit([logs[place].p.mean() for place in kept], [fits[place].level for place in kept], 1)
        level = float(np.polyval(line, log.p.mean()))
        loop = log.loop(float(np.mean([fits[place].yield_m for place in kept])))
        report(f"{log.bar} | {level:.2f}, {fits[left].level:.2f}", friction_of(log, fits[left], area), level * loop)


def report(bar: int | str, friction: Real, predicted: Real) -> None:
    error, alone = np.sqrt(np.mean((friction - predicted) ** 2)), np.sqrt(np.mean(friction**2))
    print(f"| {bar} | {error:.2f} | {100 * error / alone:.0f} % | {alone:.2f} |")


def speeds(logs: list[Log]) -> None:
    """Say which velocities were driven."""
    print("\nVelocities driven (5, 50, 95 % of samples), forward and back, mm/s:\n")
    for log in logs:
        inside = (log.x > STROKE_M[0]) & (log.x < STROKE_M[1])
        forward, back = (np.percentile(1e3 * log.v[inside & (log.v * s > 3e-3)], [5, 50, 95]) for s in (1, -1))
        print(f"- {log.bar} bar: {forward[0]:.1f} {forward[1]:.1f} {forward[2]:.1f}; ", end="")
        print(f"{back[0]:.1f} {back[1]:.1f} {back[2]:.1f}")
    print("\nOne velocity each way: neither a Stribeck velocity nor a viscous part can be told from these logs.")


if __name__ == "__main__":
    main()
