"""Schemes as the plain tables of a model file, and back, with every mistake told by its key."""

from collections.abc import Mapping
from typing import Any

from chladni.models.elements.element import Element
from chladni.models.elements.rational import RATIONAL
from chladni.models.schemes.block import Block
from chladni.models.schemes.scheme_model import DERIVATIVE_FILTER_S, SchemeModel
from chladni.models.schemes.table_reader import Loc, Number, SchemeReading, TableReader, plain_number
from chladni.signals.errors import ModelError

KEYS = ("block", "input", "output", "tolerance", "derivative_filter")


def scheme_from_tables(name: str, tables: Mapping[str, object], *, number: Number = plain_number) -> SchemeModel:
    """Build a scheme.

    Parameters
    ----------
    name
        Of the model.
    tables
        ``block``, ``input`` and ``output`` (lists of tables), ``tolerance`` and ``derivative_filter``.
    number
        ``number(value, unit) -> float`` reads a number or text with a unit; `ModelError` says what is wrong with it.

    Raises
    ------
    ModelError
        One line for each mistake, with its key.

    Examples
    --------
    >>> scheme = scheme_from_tables("loop", {
    ...     "input": [{"name": "reference"}],
    ...     "block": [
    ...         {"name": "regulator", "kind": "pi", "parameters": {"gain": 2.97, "integral_time": "9.9 s"},
    ...          "input": ["+reference", "-plant"]},
    ...         {"name": "plant", "num": [1], "den": [0.7, 1], "input": ["regulator"]},
    ...     ],
    ... })
    >>> scheme.parameters["regulator.integral_time"].value
    9.9
    """
    reading = read_scheme(name, tables, number=number)
    if reading.model is None:
        raise ModelError(*(f"{_place(loc)}: {text}" for loc, text in reading.mistakes))
    return reading.model


def read_scheme(name: str, tables: Mapping[str, object], *, number: Number = plain_number) -> SchemeReading:
    """Build a scheme, or tell all mistakes at once, each with its place; see `scheme_from_tables`."""
    reader = TableReader(number)
    reader.known_keys((), tables, KEYS)
    inputs = [reader.input(loc, table) for loc, table in reader.tables(tables, "input")]
    outputs = [reader.output(loc, table) for loc, table in reader.tables(tables, "output")]
    blocks = [reader.block(loc, table) for loc, table in reader.tables(tables, "block")]
    filter_s = reader.number(("derivative_filter",), tables.get("derivative_filter", DERIVATIVE_FILTER_S), "s")
    # Told here by table and key; the model itself would stop at the first one and know no keys.
    reader.wiring(blocks, inputs, outputs)
    model = reader.tried(
        ("block",),
        lambda: SchemeModel(
            name=name,
            blocks=tuple(block for block in blocks if block is not None),
            inputs=tuple(terminal for terminal in inputs if terminal is not None),
            outputs=tuple(output for output in outputs if output is not None),
            derivative_filter_s=DERIVATIVE_FILTER_S if filter_s is None else filter_s,
        ),
    )
    if model is not None:
        model = reader.with_tolerances(model, tables.get("tolerance", {}))
    return SchemeReading(model=None if reader.mistakes else model, mistakes=tuple(reader.mistakes))


def scheme_tables(model: SchemeModel) -> dict[str, Any]:
    """Give the tables from which `scheme_from_tables` builds the scheme again; effects are left out.

    Raises
    ------
    ModelError
        When a block is a state space, which files don't hold.
    """
    tables: dict[str, Any] = {
        "block": [_block_table(block) for block in model.blocks],
        "input": [
            {
                "name": one.name,
                **_unless(unit=(one.unit, "1"), channel=(one.channel, None), hold=(one.hold, None)),
            }
            for one in model.inputs
        ],
        "output": [
            {
                "name": one.name,
                **_unless(
                    at=(one.at, one.name), unit=(one.unit, ""), channel=(one.channel, None), hold=(one.hold, None)
                ),
            }
            for one in model.outputs
        ],
    }
    if model.derivative_filter_s != DERIVATIVE_FILTER_S:
        tables["derivative_filter"] = model.derivative_filter_s
    return {name: content for name, content in tables.items() if content}


def _block_table(block: Block) -> dict[str, Any]:
    if not isinstance(block.content, Element):
        raise ModelError(f"block {block.name!r} is a state space; files hold elements and num/den")
    kind, transfer = block.content.kind, block.content.transfer
    table: dict[str, Any] = {"name": block.name}
    if kind.name == RATIONAL:
        table |= {"num": list(transfer.num), "den": list(transfer.den)}
        table |= _unless(delay=(transfer.delay_s, 0.0))
    else:
        table |= {"kind": kind.name, "parameters": block.parameters.numbers()}
    return table | {
        "input": list(block.inputs),
        **_unless(
            on=(block.on, True),
            when_off=(block.when_off, "pass"),
            unit=(block.unit, kind.output_unit),
            input_unit=(block.input_unit, kind.input_unit),
        ),
    }


def _unless(**values: tuple[object, object]) -> dict[str, object]:
    """Keys whose value isn't what is taken without them."""
    return {key: value for key, (value, default) in values.items() if value != default}


def _place(loc: Loc) -> str:
    """``block[2].kind``."""
    text = ""
    for part in loc:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text
