"""Numbers and sentences of a page as markup; whatever comes from a model or a log is escaped."""

import re
from collections.abc import Sequence
from html import escape as inert
from math import isfinite

import numpy as np

from chladni.models.core.reading import InfluenceTable, Quantity
from chladni.signals.arrays import Mask, Real
from chladni.signals.unit_text import printed_unit
from chladni.signals.visible import visible

DASH = "–"
_EXPONENT = re.compile(r"\^(-?\d+)")
_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ",
    "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ",
    "psi": "ψ", "omega": "ω",
}  # fmt: skip
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def escape(text: str) -> str:
    r"""Make a text that came from a model or a log visible, and inert in an element or a quoted attribute.

    Examples
    --------
    >>> escape("<b>\u202e")
    '&lt;b&gt;\\u202e'
    """
    return inert(visible(text))


def number(value: float | None) -> str:
    """Give four digits of a number, a dash when there is none.

    Examples
    --------
    >>> number(0.0123456), number(123456.0), number(None)
    ('0.01235', '1.235e+05', '–')
    """
    if value is None or not isfinite(value):
        return DASH
    return f"{value:.4g}".replace("-", "\u2212") if "e" not in f"{value:.4g}" else f"{value:.4g}"


def coefficient(value: float) -> str:
    """Give a coefficient with two decimals: what is less than a hundredth doesn't matter beside one.

    Examples
    --------
    >>> coefficient(-1.0443), coefficient(4e-5), coefficient(0.0)
    ('−1.04', '+0.00', '0')
    """
    if not isfinite(value):
        return DASH
    return "0" if value == 0 else f"{value:+.2f}".replace("-", "\u2212")


def with_unit(quantity: Quantity) -> str:
    """Give number and unit of a quantity."""
    unit = "" if quantity.unit in ("", "1") or quantity.value is None else f" {printed_unit(quantity.unit)}"
    return f"{number(quantity.value)}{unit}"


def printed(text: str) -> str:
    """Give a label with raised exponents and words instead of underscores.

    Examples
    --------
    >>> printed("peak_acceleration [m/s^2]")
    'peak acceleration [m/s²]'
    """
    return _EXPONENT.sub(lambda found: found[1].translate(_RAISED), text.replace("_", " "))


def symbol(letter: str) -> str:
    """Give the paper's letter as markup, what follows an underscore lowered.

    Examples
    --------
    >>> symbol("a_m")
    'a<sub>m</sub>'
    """
    head, _, tail = letter.partition("_")
    head, tail = _GREEK.get(head, head), _GREEK.get(tail, tail)
    return escape(head) + (f"<sub>{escape(tail)}</sub>" if tail else "")


def quantity_strip(quantities: Sequence[Quantity]) -> str:
    """Quantities as a row of small cards; the definition shows when one points at a card, or tabs to it."""
    # Focusable, so that a definition can be read without a mouse.
    cards = "".join(
        f'<div class="q" tabindex="0" title="{escape(one.definition)}" aria-label="{escape(_spoken(one))}">'
        f"<b>{escape(with_unit(one))}</b><span>{escape(printed(one.name))}</span></div>"
        for one in quantities
        if one.value is not None
    )
    # Not as empty cards: half of the numbers don't exist for an open loop, and dashes would push charts down.
    missing = ", ".join(
        f'<span title="{escape(one.definition)}">{escape(printed(one.name))}</span>'
        for one in quantities
        if one.value is None
    )
    return f'<div class="strip">{cards}{f"<div class=none>none: {missing}</div>" if missing else ""}</div>'


def message(error: str, flags: Sequence[str]) -> str:
    """The line that says what is wrong, and the sentences about validity; empty when all is well."""
    wrong = f'<div class="m error" role="alert">{escape(error)}</div>' if error else ""
    return wrong + "".join(f'<div class="m" role="status">{escape(flag)}</div>' for flag in flags)


def quantity_table(columns: Sequence[tuple[str, str, Sequence[Quantity]]]) -> str:
    """Quantities of several variants side by side; each column has a label, a colour and its quantities."""
    names = list(dict.fromkeys(one.name for _, _, quantities in columns for one in quantities))
    head = "".join(
        f'<th><span style="color:{escape(colour)}">&#9632;</span> {escape(label)}</th>'
        for label, colour, _ in columns
    )
    rows = []
    for name in names:
        # Variants may have other quantities, as with another option.
        found = [next((one for one in quantities if one.name == name), None) for _, _, quantities in columns]
        definition = next((one.definition for one in found if one is not None), "")
        cells = "".join(f"<td>{escape(with_unit(one)) if one is not None else DASH}</td>" for one in found)
        rows.append(f'<tr><td title="{escape(definition)}" tabindex="0">{escape(printed(name))}</td>{cells}</tr>')
    return f"<table><thead><tr><th></th>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def influence_table(table: InfluenceTable) -> str:
    """Influence coefficients: in each cell the finite one (the paper's C), and the log-derivative beside it."""
    head = "".join(
        f'<th tabindex="0" title="{escape(definition)}">{escape(printed(name))}</th>'
        for name, definition in zip(table.behaviour, table.definitions, strict=True)
    )
    nominal = "".join(f"<td>{number(float(value))}</td>" for value in table.nominal)
    # By size: the strongest may well be the one that lowers.
    by_row, by_column = _strongest(table.finite, axis=1), _strongest(table.finite, axis=0)
    rows = "".join(
        f"<tr><td>{escape(name.replace('_', ' '))} <small>({100 * -float(change):+.3g} %)</small></td>"
        + "".join(
            _influence_cell(
                float(table.finite[row, column]),
                float(table.log_derivative[row, column]),
                strongest=bool(by_row[row, column]),
                strongest_of_column=bool(by_column[row, column]),
            )
            for column in range(len(table.behaviour))
        )
        + "</tr>"
        for row, (name, change) in enumerate(zip(table.construction, table.change, strict=True))
    )
    return (
        f'<div class="wide"><table class="influence"><thead><tr><th>change of</th>{head}</tr></thead>'
        f'<tbody><tr class="now"><td>now</td>{nominal}</tr>{rows}</tbody></table></div>'
        "<p>Each cell: relative change of behaviour over relative change of construction, by the finite change in "
        "the first column, and in grey the exact log-derivative. <b>Bold</b>: strongest of its row; "
        '<span class="column">shaded</span>: strongest of its column.</p>'
    )


def _influence_cell(finite: float, derivative: float, *, strongest: bool, strongest_of_column: bool) -> str:
    text = f"<b>{coefficient(finite)}</b>" if strongest else coefficient(finite)
    shaded = ' class="column"' if strongest_of_column else ""
    return f"<td{shaded}>{text}<small>{coefficient(derivative)}</small></td>"


def _strongest(values: Real, *, axis: int) -> Mask:
    # NaN is no influence; it must not win.
    size = np.nan_to_num(np.abs(values), nan=-1.0)
    return np.asarray((size == size.max(axis=axis, keepdims=True, initial=-1.0)) & (size > 0))


def _spoken(quantity: Quantity) -> str:
    told = f"; {quantity.definition}" if quantity.definition else ""
    return f"{printed(quantity.name)} {with_unit(quantity)}{told}"


STRIP_CSS = """
.strip { display: flex; flex-wrap: wrap; gap: 2px 0; align-items: baseline; line-height: 1.2; }
.q { padding: 0 10px; border-left: 2px solid var(--c-line); }
.q b { display: block; font-size: 13px; font-variant-numeric: tabular-nums; white-space: nowrap; }
.q span { color: var(--c-soft); font-size: 11px; white-space: nowrap; }
.none { color: var(--c-soft); font-size: 11px; padding-left: 10px; }
"""
MESSAGE_CSS = """
.m {
  background: var(--c-warning-ground); color: var(--c-warning); border-radius: 4px; padding: 2px 8px;
  margin-bottom: 3px; max-width: 100%; box-sizing: border-box;
}
.m.error { font-weight: 600; }
"""
INFLUENCE_CSS = """
.wide { overflow-x: auto; }
.influence th { white-space: normal; vertical-align: bottom; }
.influence td small { display: block; }
.influence td:first-child small { display: inline; }
.influence small, td small { color: var(--c-soft); margin-left: 6px; font-size: 11px; }
.influence .now td { color: var(--c-soft); }
.column { background: var(--c-warning-ground); border-radius: 3px; padding-left: 4px; }
p { color: var(--c-soft); max-width: 72em; }
"""
