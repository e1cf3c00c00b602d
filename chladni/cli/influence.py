"""``chladni influence``: how much each behaviour parameter changes with each construction parameter."""

from itertools import pairwise
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.settings import with_settings

if TYPE_CHECKING:
    from chladni.models.core.reading import InfluenceTable
    from chladni.signals.arrays import Real

IN_ROW, IN_COLUMN = "*", "†"
# Coefficients are printed with three decimals; below this they read as zero.
HALF_LAST_DIGIT = 5e-4
# "+10.118*†", and what the table puts between two columns.
CELL_WIDTH, BETWEEN_COLUMNS = 9, 2


def influence(
    model: Annotated[
        str, typer.Argument(metavar="MODEL", help="A model file, or the name of an instrument.", show_default=False)
    ],
    *,
    parameter: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Only this construction parameter; may be repeated.", show_default=False),
    ] = None,
    change: Annotated[
        float, typer.Option(metavar="SHARE", help="Relative change of each parameter for the finite coefficients.")
    ] = 0.1,
    at: Annotated[
        str | None, typer.Option(metavar="NAME", help="Input that steps; the model's own if not given.")
    ] = None,
    output: Annotated[
        str | None, typer.Option(metavar="NAME", help="Output whose behaviour counts; the model's own if not given.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a parameter; may be repeated.", show_default=False),
    ] = None,
    json: options.Json = None,
    figures: options.Figures = None,
) -> None:
    """Influence coefficients of every behaviour parameter to every construction parameter."""
    from chladni.apps.influence_document import influence_document
    from chladni.apps.model_sources import named_instrument
    from chladni.models.analysis.influence import influence as coefficients
    from chladni.models.core.stability import growing_poles

    require_places(reads=[Path(model)], writes={"--json": json}, folders={"--figures": figures})
    to = Output(json)
    instrument = named_instrument(model)
    chosen = with_settings(instrument.model(), settings or ())
    table = coefficients(
        chosen,
        parameters=parameter or (),
        changes=change,
        from_input=at or instrument.step_input,
        to_output=output or instrument.step_output,
    )
    _print(to, table, change)
    growing = growing_poles(chosen.compile())
    if growing.size:
        listed = ", ".join(f"{pole.real:.4g} + {pole.imag:.4g}j" for pole in growing)
        to.lines([f"Warning: unstable, with poles at {listed} rad/s: what is told of final values is of no use"])
    if figures is not None:
        from chladni.viewers.figures.influence import influence_figure

        drawn = {"influence": influence_figure(table), "influence finite": influence_figure(table, of="finite")}
        to.figures("influence", drawn, figures)
    to.json(influence_document, table)


def _print(to: Output, table: "InfluenceTable", change: float) -> None:
    """Print both tables without the rows and columns in which nothing acts, and the definitions."""
    import numpy as np

    acts = np.abs(np.nan_to_num(table.log_derivative)) >= HALF_LAST_DIGIT
    rows, columns = np.flatnonzero(acts.any(axis=1)), np.flatnonzero(acts.any(axis=0))
    # Broken between words, or the table would rather cut names in two than wrap a heading.
    heads = [_words(table.behaviour[column]).replace(" ", "\n") for column in columns]
    names = [table.construction[row] for row in rows]
    for title, coefficients in (
        (f"Influence by a finite change of {change:+.0%} (C = R_PCD/R_PCF)", table.finite),
        ("Influence for small changes (d ln behaviour / d ln construction)", table.log_derivative),
    ):
        cells = _rows(names, coefficients[np.ix_(rows, columns)])
        for part in _parts(heads, max(map(len, names), default=0), to.console.width):
            to.table(
                title,
                ["", *(heads[one] for one in part)],
                [[row[0], *(row[1 + one] for one in part)] for row in cells],
            )
            to.line()
    to.line(f"{IN_ROW} strongest of its row, {IN_COLUMN} strongest of its column; - where there is none")
    to.lines([f"{_words(table.behaviour[column])}: {table.definitions[column]}" for column in columns])
    idle = [table.construction[row] for row in range(len(table.construction)) if row not in rows]
    unmoved = [_words(table.behaviour[column]) for column in range(len(table.behaviour)) if column not in columns]
    if idle:
        to.lines([f"Acts on none of these: {', '.join(idle)}"])
    if unmoved:
        to.lines([f"No parameter changes, or there is none: {', '.join(unmoved)}"])


def _parts(heads: list[str], name_width: int, width: int) -> list[range]:
    """Columns that stand side by side in a terminal, so that neither a name nor a number is cut in two."""
    ends = [0]
    used = name_width
    for place, head in enumerate(heads):
        needed = BETWEEN_COLUMNS + max(CELL_WIDTH, *map(len, head.split()))
        if place > ends[-1] and used + needed > width:
            ends.append(place)
            used = name_width
        used += needed
    return [range(first, last) for first, last in pairwise([*ends, len(heads)])]


def _rows(names: list[str], coefficients: "Real") -> list[list[str]]:
    from chladni.models.analysis.influence import strongest

    marked = strongest(coefficients)
    return [
        [
            name,
            *(
                _cell(value, in_row=marked.of_rows[row] == column, in_column=marked.of_columns[column] == row)
                for column, value in enumerate(coefficients[row].tolist())
            ),
        ]
        for row, name in enumerate(names)
    ]


def _cell(value: float, *, in_row: bool, in_column: bool) -> str:
    """A coefficient with its marks, which take two characters always, so that the numbers line up."""
    if isnan(value):
        return "-  "
    text = f"{value:+.3f}" if abs(value) >= HALF_LAST_DIGIT else "0"
    return f"{text}{IN_ROW if in_row else ' '}{IN_COLUMN if in_column else ' '}"


def _words(name: str) -> str:
    return name.replace("_", " ")
