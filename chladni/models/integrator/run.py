"""One run of a model with laws: memory for the kernel, and what to do when it stops on the way."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, log2

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.explicit_kernel import Drive, Stride
from chladni.models.integrator.hold import Hold
from chladni.models.integrator.implicit_kernel import STAGES, Newton, implicit_step
from chladni.models.integrator.inside_kernel import Dense, inside
from chladni.models.integrator.judge_kernel import Judge
from chladni.models.integrator.march import (
    AUTOMATIC,
    COARSEST,
    DEEPER,
    DONE,
    EXPLICIT,
    HARD,
    IMPLICIT,
    LEVEL,
    LOOKED,
    MORE_HISTORY,
    POSITION,
    PREVIOUS,
    REFINED,
    SAMPLE,
    STEPS,
    STIFF,
    TOO_MANY,
    TRIED,
    UNIT,
    Course,
    march,
)  # fmt: skip
from chladni.models.integrator.march_implicit import alternate, march_implicit
from chladni.models.integrator.plane import book
from chladni.models.integrator.port_kernel import History, ask_delays, ask_laws, ports_of
from chladni.models.integrator.port_plan import LawTable, PortPlan
from chladni.models.integrator.step_tables import DEEPEST, StepTables
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

_SCHEMES = {"automatic": AUTOMATIC, "explicit": EXPLICIT, "implicit": IMPLICIT}
#: Delays below this share of a sample interval are refused: every step would have to be as short.
_SHORTEST_DELAY = 2.0**-10
#: Steps, tried ones included, that a run may take for each sample on average.
_STEPS_A_SAMPLE = 1000


@dataclass(frozen=True, slots=True)
class RunResult:
    """``[sample, ...]``: states, motion and forces at the ports; ``dense [instant, output, sample]`` inside steps."""

    state: Real
    motion: Real
    force: Real
    dense: Real
    refined: int
    steps: int


class Run:
    """Memory of one run."""

    def __init__(
        self,
        compiled: CompiledModel,
        plan: PortPlan,
        hold: Hold,
        laws: LawTable,
        tables: StepTables,
        *,
        tolerance: float,
        scheme: str,
    ) -> None:
        self._compiled, self._plan, self._hold, self._laws, self._tables = compiled, plan, hold, laws, tables
        self._rate_hz = 1.0 / tables.step_s
        # Laws in a loop can be met by Newton only.
        self._scheme = _SCHEMES["implicit" if plan.looped else scheme]
        self._coarsest = self._coarsest_level()
        self._ports = ports_of(plan, laws)
        self._words = book(self._ports)
        self._newton = _newton(len(plan.ports), laws.state.size)
        self._soft = self._scheme != IMPLICIT
        self._judge = Judge(
            effect=tables.effect,
            weight=np.zeros(self._ports.channels.shape[1]),
            difference=_difference_weights(),
            before=np.zeros((2, self._ports.channels.shape[1])),
            tolerance=np.array([tolerance]),
        )

    def march(self, rows: Real, start: Real) -> RunResult:
        """Run through all rows but the last, which is where the run ends."""
        plan, n, p = self._plan, start.size, len(self._plan.ports)
        stride = _stride(plan, self._hold, self._laws, start)
        course = _course(stride, len(rows), p, self._coarsest, implicit=self._scheme == IMPLICIT)
        drive = _drive(self._hold, rows)
        dense = self._dense(len(rows))
        history = _history(plan, len(rows))
        for first, stop in self._segments(rows):
            self._begin(stride, course, history, rows[first], first)
            history = self._segment(stride, course, drive, dense, history, stop)
        course.point[-1], course.force[-1] = stride.here, self._ports.channels[0, :p]
        return RunResult(
            state=course.point[:, :n],
            motion=course.point[:, course.point.shape[1] - 2 * p :],
            force=course.force,
            dense=dense.output,
            refined=int(course.cursor[REFINED]),
            steps=int(course.cursor[STEPS]),
        )

    def _segments(self, rows: Real) -> list[tuple[int, int]]:
        """Stretches of steps that no jump of an input divides: of one that the laws see at once, see `Hold`."""
        m, lines = self._hold.columns, self._hold.straight
        # The last rate of a smooth input may jump, the input itself doesn't.
        seen = self._plan.motion_column[:, lines].any(axis=0) & ~np.isin(lines, self._hold.rate)
        ends = rows[:-1, lines] + rows[:-1, m : m + lines.size]
        for kink, column in enumerate(self._hold.kinked):
            after = 1.0 - self._hold.kink_at[kink]
            place = m + lines.size + kink
            line = int(np.searchsorted(lines, column))
            ends[:, line] += after * rows[:-1, place] + rows[:-1, place + self._hold.kinked.size]
        scale = np.abs(rows[:, lines]).max(axis=0, initial=0.0)
        jumps = np.flatnonzero((np.abs(ends - rows[1:, lines]) > 1e-9 * scale)[:, seen].any(axis=1)) + 1
        stops = sorted({0, *jumps.tolist(), len(rows) - 1})
        return list(pairwise(stops))

    def _begin(self, stride: Stride, course: Course, history: History, row: Real, sample: int) -> None:
        """Forces and rates at the start of a segment."""
        plan, ports, n = self._plan, self._ports, self._plan.a.shape[0]
        t = sample / self._rate_hz
        base = plan.motion_state @ stride.here[:n] + plan.motion_column @ row[: self._hold.columns]
        ports.state[:] = stride.here[n : n + ports.state.size]
        if plan.delay_s.size:
            words = book(history, ports)
            ask_delays(words.ctypes.data, t + 1e-9 / self._rate_hz, 0)
        if plan.looped:
            self._solve_loop(base, t)
        else:
            ports.motion[:] = base
            ask_laws(self._words.ctypes.data, t, 1)
        stride.here[n + ports.state.size :] = ports.motion
        course.cursor[PREVIOUS] = -1
        self._newton.stiffness[0] = 0.0
        if not np.all(np.isfinite(ports.channels[0])):
            raise ModelError(f"{self._where(ports.channels[0])} gives no number at {t:g} s; check its parameters")

    def _solve_loop(self, base: Real, t: float) -> None:
        """Forces that agree with the motion that they themselves make at once: damped Newton."""
        count = len(self._plan.ports)
        through = self._plan.through.reshape(2 * count, count)
        force = np.zeros(count)
        for _ in range(100):
            missed = self._loop_residual(base, through, force, t)
            size = np.abs(missed).max()
            if size <= 1e-12 * max(1e-300, np.abs(force).max()):
                return
            by = 1e-7 * np.maximum(np.abs(force), np.abs(missed).max())
            slope = [(self._loop_residual(base, through, force + step, t) - missed) for step in np.diag(by)]
            change = -np.linalg.lstsq(np.array(slope).T / by, missed)[0]
            factors = 0.5 ** np.arange(20)
            sizes = [np.abs(self._loop_residual(base, through, force + f * change, t)).max() for f in factors]
            best = int(np.argmin(sizes))
            if not sizes[best] < size:
                break
            force = force + factors[best] * change
        if np.abs(self._loop_residual(base, through, force, t)).max() > 1e-9 * max(1e-300, np.abs(force).max()):
            names = ", ".join(self._compiled.ports[port].name for port in self._plan.ports)
            raise ModelError(
                f"the laws at {names} form an algebraic loop without a solution at {t:g} s; open the loop"
            )

    def _loop_residual(self, base: Real, through: Real, force: Real, t: float) -> Real:
        self._ports.motion[:] = base + through @ force
        ask_laws(self._words.ctypes.data, t, 0)
        found = self._ports.channels[0, : force.size].copy()
        self._ports.channels[0, : force.size] = force
        return found - force

    def _segment(
        self, stride: Stride, course: Course, drive: Drive, dense: Dense, history: History, stop: int
    ) -> History:
        """March to `stop`, making finer tables and more room when the kernel asks for them."""
        most = 1_000_000 + _STEPS_A_SAMPLE * len(drive.rows)
        while True:
            status = self._march(stride, course, drive, dense, history, stop, most)
            if status == DONE:
                return history
            if status == DEEPER:
                self._tables.deepen(min(DEEPEST + 1, max(3, 2 * self._tables.levels)))
            elif status == STIFF:
                self._soft, course.cursor[HARD] = False, 1
            elif status == MORE_HISTORY:
                history = _shorter(history, float(self._plan.delay_s.max()))
            else:
                raise self._failure(course, stride, status)

    def _march(
        self, stride: Stride, course: Course, drive: Drive, dense: Dense, history: History, stop: int, most: int
    ) -> int:
        tables, judge, step_s = self._tables, self._judge._replace(effect=self._tables.effect), 1.0 / self._rate_hz
        words = book(
            tables.explicit, self._ports, stride, drive, course, judge, tables.implicit, self._newton,
            tables.dense, history, dense,
        )  # fmt: skip
        has_inside = self._plan.delay_s.size > 0 or tables.instants.size > 0
        within = inside.address if has_inside else 0
        arguments = step_s, stop, int(self._scheme == AUTOMATIC), most, within
        # Most models need explicit steps alone: the other kernels are compiled when they're met.
        if self._soft:
            return march(words.ctypes.data, *arguments)
        self._newton.address[0] = implicit_step.address
        hard = int(course.cursor[HARD])
        return alternate(words.ctypes.data, march.address, march_implicit.address, hard, *arguments)

    def _failure(self, course: Course, stride: Stride, status: int) -> ModelError:
        t = (course.cursor[SAMPLE] + course.cursor[POSITION] / UNIT) / self._rate_hz
        largest = np.abs(stride.here[: self._plan.a.shape[0]]).max(initial=0.0)
        place = self._where(np.abs(self._ports.channels[4] - self._ports.channels[3]) * self._judge.weight)
        if status == TOO_MANY:
            return ModelError(
                f"{place} switches too fast at {t:g} s: {course.cursor[TRIED]} steps for "
                f"{course.cursor[SAMPLE]} samples; make its transition wider, or raise the sample rate"
            )
        if not largest < 1e100:
            return ModelError(f"the model diverges at {t:g} s at {place}; the loop is unstable, lower its gain")
        return ModelError(
            f"{place} can't be met at {t:g} s, even with steps of {1 / self._rate_hz / UNIT:.1e} s: it jumps or "
            "gives no number there; check its parameters, or make its transition wider"
        )

    def _where(self, channels: Real) -> str:
        """Words for the port whose channel is largest, or not a number."""
        channel = int(np.argmax(np.where(np.isfinite(channels), np.abs(channels), np.inf)))
        count = len(self._plan.ports)
        if channel >= count:
            law = int(np.searchsorted(self._laws.table[:, 2], channel - count, side="right")) - 1
            port = self._laws.laws[law].port
        else:
            port = self._plan.ports[channel]
        laws = [law.function.__name__ for law in self._laws.laws if law.port == port] or ["delay"]
        return f"{self._compiled.ports[port].name!r} ({', '.join(laws)})"

    def _coarsest_level(self) -> int:
        """Steps are no longer than the shortest delay, so that what it gives is known when a step is made."""
        if not self._plan.delay_s.size:
            return 0
        shortest = float(self._plan.delay_s.min())
        ratio = shortest * self._rate_hz
        if ratio < _SHORTEST_DELAY:
            port = self._plan.ports[self._plan.delay_port[int(np.argmin(self._plan.delay_s))]]
            raise ModelError(
                f"the delay of {shortest:g} s at {self._compiled.ports[port].name!r} is shorter than a thousandth of "
                f"the sample interval ({1 / self._rate_hz:g} s); leave it out, or raise the sample rate"
            )
        return max(0, ceil(-log2(ratio) - 1e-12))

    def _dense(self, count: int) -> Dense:
        outputs, instants = self._plan.c.shape[0], self._tables.instants
        ports = len(self._plan.ports)
        return Dense(
            row=np.zeros(2 * ports + outputs),
            power=np.zeros((3, self._ports.channels.shape[1])),
            place=np.floor(instants * UNIT).astype(np.int64),
            force_output=np.ascontiguousarray(self._plan.h),
            output=np.zeros((instants.size, outputs, count - 1)),
        )


def _newton(count: int, states: int) -> Newton:
    channels = count + states
    size = STAGES * channels
    return Newton(
        value=np.zeros((STAGES, channels)),
        trial=np.zeros((STAGES, channels)),
        change=np.zeros(size),
        residual=np.zeros(size),
        slope=np.zeros((STAGES, channels, 2 * count + states)),
        matrix=np.zeros((size, size)),
        channel_scale=np.zeros((2, channels)),
        stiffness=np.zeros((3, channels)),
        address=np.zeros(1, dtype=np.int64),
    )


def _stride(plan: PortPlan, hold: Hold, laws: LawTable, start: Real) -> Stride:
    n, count = plan.a.shape[0], len(plan.ports)
    here = np.concatenate([start, laws.state, np.zeros(2 * count)])
    return Stride(
        here=here,
        there=np.zeros(here.size),
        scale=np.abs(here),
        inputs=np.zeros(hold.width),
        coming=np.zeros(hold.width),
        lines=np.zeros(n + 2 * STAGES * count),
        ahead=np.zeros(n),
        inner=np.zeros(2 * count),
        grown=np.zeros(1, dtype=np.int64),
    )


def _course(stride: Stride, count: int, ports: int, coarsest: int, *, implicit: bool) -> Course:
    cursor = np.zeros(11, dtype=np.int64)
    cursor[LEVEL] = cursor[COARSEST] = coarsest
    cursor[PREVIOUS] = cursor[LOOKED] = -1
    cursor[HARD] = int(implicit)
    return Course(cursor=cursor, point=np.zeros((count, stride.here.size)), force=np.zeros((count, ports)))


def _drive(hold: Hold, rows: Real) -> Drive:
    line = np.full(hold.columns, -1, dtype=np.int64)
    line[hold.straight] = np.arange(hold.straight.size)
    return Drive(rows, hold.rate, line, hold.straight, hold.kinked, hold.kink_at)


def _history(plan: PortPlan, count: int) -> History:
    room = 2 * count + 1000 if plan.delay_s.size else 1
    return History(
        begin=np.zeros(room),
        length=np.zeros(room),
        value=np.zeros((room, plan.delay_s.size, 5)),
        hint=np.zeros(plan.delay_s.size + 1, dtype=np.int64),
    )


def _shorter(history: History, longest_s: float) -> History:
    """Forget what no delay line asks for any more; more room when that is little."""
    count = int(history.hint[-1])
    first = int(np.searchsorted(history.begin[:count], history.begin[count - 1] - 1.01 * longest_s, side="right"))
    first = max(0, first - 2)
    room = history.begin.size if first > count // 2 else 2 * history.begin.size
    kept = []
    for array in (history.begin, history.length, history.value):
        fresh = np.zeros((room, *array.shape[1:]))
        fresh[: count - first] = array[first:count]
        kept.append(fresh)
    hint = np.zeros_like(history.hint)
    hint[-1] = count - first
    return History(kept[0], kept[1], kept[2], hint)


def _difference_weights() -> Real:
    """Fourth difference on the start and middle of the step before, and the start, middle and end of this one.

    One row for each ratio of their lengths; the weight of this step's middle is 1.
    """
    rows = []
    for change in range(-DEEPEST, DEEPEST + 1):
        before = 2.0**change
        nodes = np.array([-before, -before / 2, 0.0, 0.5, 1.0])
        apart = nodes[:, None] - nodes + np.eye(5)
        weights = 1 / apart.prod(axis=1)
        rows.append(weights / weights[3])
    return np.array(rows)
