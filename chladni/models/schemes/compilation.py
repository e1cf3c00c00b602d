"""From a scheme to a compiled model: every point an output, ports where effects may act."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from chladni.models.core.balance import balance
from chladni.models.core.compiled_model import CompiledModel, DelayLine, IdealDerivative
from chladni.models.core.port import Port, Terminal
from chladni.models.schemes.block import Block
from chladni.models.schemes.derivative_filter import FilteredEquations, filtered_derivatives, lag_names
from chladni.models.schemes.descriptor import Reduced
from chladni.models.schemes.equations import delay_of, solved_equations
from chladni.models.schemes.points import Point, points_of
from chladni.models.schemes.scheme_output import SchemeOutput
from chladni.models.schemes.wiring import Wiring, wired
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """A port before it's one: what it adds to and what it sees."""

    port: Port
    block: int
    delay_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Columns(Value):
    """What each column of w = [inputs, ports] adds, before the loops are closed.

    Attributes
    ----------
    into
        ``[block, column]``: to what goes into each block.
    behind
        ``[block, column]``: to what leaves each block.
    """

    into: Real
    behind: Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Rows(Value):
    """Signals as sums ``from_y y + from_w w``, y what leaves each block before its dead time."""

    from_y: Real
    from_w: Real


def compiled_scheme(
    blocks: Sequence[Block],
    inputs: Sequence[Terminal],
    outputs: Sequence[SchemeOutput],
    *,
    sites: frozenset[str],
    filter_time_s: float,
) -> CompiledModel:
    """Close all loops and give the equations from inputs and ports to every point.

    Parameters
    ----------
    sites
        Blocks at which effects will act. A port whose signal would have to be differentiated is left out elsewhere,
        because it costs states that nobody needs.
    filter_time_s
        Time constant of the lags of what is improper.

    Raises
    ------
    ModelError
        When the signals of a loop are not determined.
    """
    return _compiled(tuple(blocks), tuple(inputs), tuple(outputs), sites, filter_time_s)


# One setting is compiled for its charts, for its own chart and for its flags; the matrices of a large scheme are too
# big to keep more.
@lru_cache(maxsize=2)
def _compiled(
    blocks: tuple[Block, ...],
    inputs: tuple[Terminal, ...],
    outputs: tuple[SchemeOutput, ...],
    sites: frozenset[str],
    filter_time_s: float,
) -> CompiledModel:
    # What overflows is found where it's used, and told in words.
    with np.errstate(all="ignore"):
        return _equations(blocks, inputs, outputs, sites, filter_time_s)


def _equations(
    blocks: Sequence[Block],
    inputs: Sequence[Terminal],
    outputs: Sequence[SchemeOutput],
    sites: frozenset[str],
    filter_time_s: float,
) -> CompiledModel:
    wiring = wired(blocks, inputs)
    places = _places(blocks)
    equations, states, columns = _closed(blocks, wiring, places)
    kept = [
        place
        for number, place in enumerate(places)
        if place.delay_s or place.port.name in sites or not equations.d[1:, :, len(inputs) + number].any()
    ]
    if len(kept) < len(places):
        # A column less may need a derivative less elsewhere too, so the loops are closed again.
        places = kept
        equations, states, columns = _closed(blocks, wiring, places)
    points = points_of(blocks, outputs)
    fed = {place.block for place in places if place.delay_s}
    # Behind a dead time that feeds nothing the signal is only read later: exact for any signal, and no loop.
    offsets = [0.0 if point.before or point.block in fed else delay_of(blocks[point.block]) for point in points]
    rows = _stacked(_point_rows(points, wiring, columns), _port_rows(places, wiring, columns, len(inputs)))
    compiled = _assembled(equations, states, rows, points, inputs, places, filter_time_s)
    return replace(compiled, output_offsets_s=tuple(offsets))


def _places(blocks: Sequence[Block]) -> list[_Place]:
    """Ports at what enters and what leaves each block, then at dead times."""
    used = {source for block in blocks for source, _ in block.sources}
    entering = [
        _Place(
            port=Port(name=block.name, kind="input", unit=block.input_unit, displacement_unit=block.input_unit),
            block=row,
        )
        for row, block in enumerate(blocks)
    ]
    # Where nothing follows, an effect acts on the output itself and needs no port.
    leaving = [
        _Place(port=Port(name=block.name, kind="output", unit=block.unit, displacement_unit=block.unit), block=row)
        for row, block in enumerate(blocks)
        if block.name in used
    ]
    late = [
        _Place(
            # No effect finds this name, which is no site's.
            port=Port(name=f"{block.name}.delay", kind="output", unit=block.unit, displacement_unit=block.unit),
            block=row,
            delay_s=delay_of(block),
        )
        for row, block in enumerate(blocks)
        if delay_of(block) and block.name in used
    ]
    return [*entering, *leaving, *late]


def _closed(
    blocks: Sequence[Block], wiring: Wiring, places: Sequence[_Place]
) -> tuple[Reduced, tuple[str, ...], _Columns]:
    count = len(blocks)
    behind = np.zeros((count, wiring.inputs.shape[1] + len(places)))
    into = np.hstack([wiring.inputs, np.zeros((count, len(places)))])
    for number, place in enumerate(places, start=wiring.inputs.shape[1]):
        # What an input port adds enters the block; all else joins behind it, and reaches whom the block feeds.
        (into if place.port.kind == "input" else behind)[place.block, number] = 1.0
    columns = _Columns(into=into + wiring.blocks @ behind, behind=behind)
    return *solved_equations(blocks, wiring.blocks, columns.into), columns


def _point_rows(points: Sequence[Point], wiring: Wiring, columns: _Columns) -> _Rows:
    place = [point.block for point in points]
    before = np.array([point.before for point in points], dtype=bool)[:, None]
    return _Rows(
        from_y=np.where(before, wiring.blocks[place], np.eye(len(wiring.blocks))[place]),
        from_w=np.where(before, columns.into[place], columns.behind[place]),
    )


def _port_rows(places: Sequence[_Place], wiring: Wiring, columns: _Columns, inputs: int) -> _Rows:
    """What each port sees: the signal without what acts at the port itself or behind it."""
    block = [place.block for place in places]
    entering = np.array([place.port.kind == "input" for place in places], dtype=bool)[:, None]
    from_w = np.where(entering, columns.into[block], columns.behind[block])
    own = np.arange(len(places))
    # By the contract of ports, d is the signal without the port's own f; what comes back round a loop stays in it.
    from_w[own, inputs + own] = np.where(entering[:, 0], from_w[own, inputs + own] - 1.0, 0.0)
    # A dead time comes first behind its block: it sees what the block gives, without what effects add behind it.
    from_w[[bool(place.delay_s) for place in places]] = 0.0
    return _Rows(from_y=np.where(entering, wiring.blocks[block], np.eye(len(wiring.blocks))[block]), from_w=from_w)


def _stacked(first: _Rows, second: _Rows) -> _Rows:
    return _Rows(from_y=np.vstack([first.from_y, second.from_y]), from_w=np.vstack([first.from_w, second.from_w]))


def _assembled(
    equations: Reduced,
    states: Sequence[str],
    rows: _Rows,
    points: Sequence[Point],
    inputs: Sequence[Terminal],
    places: Sequence[_Place],
    filter_time_s: float,
) -> CompiledModel:
    """Sort the equations into those of outputs and of ports, with lags where signals are improper."""
    powers = rows.from_y @ equations.d
    powers[0] += rows.from_w
    full = filtered_derivatives(
        *_balanced(equations.a, equations.b, rows.from_y @ equations.c), powers, filter_time_s=filter_time_s
    )
    m, p = len(inputs), len(points)
    names = [*(terminal.name for terminal in inputs), *(place.port.name for place in places)]
    ports = [*(place.port for place in places), *_derivative_ports(full, names)]
    return CompiledModel(
        # Behind the inputs' columns come those of the ports, behind the points' rows those of what ports see.
        a=full.a, b=full.b[:, :m], c=full.c[:p], d=full.d[:p, :m], g=full.b[:, m:], h=full.d[:p, m:],
        displacement_state=full.c[p:],
        displacement_column=full.d[p:, :m],
        displacement_port=full.d[p:, m:],
        velocity_state=np.zeros((len(ports), full.a.shape[0])),
        velocity_column=np.zeros((len(ports), m)),
        velocity_port=np.zeros((len(ports), len(ports))),
        inputs=tuple(inputs),
        outputs=tuple(point.terminal for point in points),
        states=(*states, *lag_names(full.sources, full.orders, names)),
        ports=tuple(ports),
        delays=tuple(
            DelayLine(port=number, delay_s=place.delay_s) for number, place in enumerate(places) if place.delay_s
        ),
        derivatives=tuple(
            IdealDerivative(port=number, order=order, filter_time_s=filter_time_s)
            for number, order in enumerate(full.orders, start=len(places))
        ),
    )  # fmt: skip


def _derivative_ports(full: FilteredEquations, names: Sequence[str]) -> list[Port]:
    """Ports at which a frequency response adds what the lags take away; `names` are those of the columns of w."""
    return [
        Port(name=f"{names[source]}.derivative{order}", kind="input", unit="1", displacement_unit="1")
        for source, order in zip(full.sources, full.orders, strict=True)
    ]


def _balanced(a: Real, b: Real, c: Real) -> tuple[Real, Real, Real]:
    """States in units that make rows and columns of A of like size: gains of 1e9 between them would cost digits."""
    if not a.size:
        return a, b, c
    if not np.all(np.isfinite(a)):
        raise ModelError("gains and time constants lie too far apart for floating point numbers")
    balanced, scale = balance(a)
    return balanced, b / scale[:, None], c * scale
