"""Rows of the tables that tell where a gap lies, what was weighed and what was tuned."""

from collections.abc import Sequence

from chladni.gap.records.diagnosis import Diagnosis, FittedNumber, Where
from chladni.viewers.effect_words import effect_heading
from chladni.viewers.engineering import chance, engineering, percent

Table = tuple[Sequence[str], Sequence[Sequence[str]]]

# As many as one reads; the document holds all.
RANKED = 5
# A parameter that moved by less than its own sigma, and by less than this, didn't move.
MOVED = 1e-3
# A sigma so many times the value tells nothing of it.
WIDE = 100.0


def channel_table(where: Where) -> Table:
    """Gap and noise of each output, over its own RMS; the largest first."""
    rows = sorted(where.channels, key=lambda one: -one.gap)
    return ("Output", "Gap", "Noise"), [(one.name, percent(one.gap), percent(one.noise)) for one in rows]


def band_table(where: Where, *, least: float = 0.0) -> Table:
    """Share of the gap's power in each band, those with `least` and more, by frequency."""
    rows = [
        (f"{one.low_hz:.4g} to {one.high_hz:.4g}", percent(one.share))
        for one in sorted(where.bands, key=lambda one: one.low_hz)
        if one.share >= least
    ]
    return ("Band [Hz]", "Share"), rows


def site_table(where: Where, *, count: int | None = None) -> Table:
    """Share of the gap that an unknown force at each site explains; the largest first, at most `count`."""
    rows = sorted(where.sites, key=lambda one: -one.share)[:count]
    return ("Site", "Explains"), [(one.name, percent(one.share)) for one in rows]


def regime_table(where: Where, *, least: float = 0.0) -> Table:
    """Share of the gap's power in each regime, those with `least` and more; the largest first."""
    rows = sorted(where.regimes, key=lambda one: -one.share)
    return ("While", "is between", "Share"), [
        (one.variable, f"{one.low:.3g} to {one.high:.3g}", percent(one.share)) for one in rows if one.share >= least
    ]


def ranking_table(found: Diagnosis, *, count: int = RANKED) -> Table:
    """Candidates by falling probability."""
    return ("Effect", "Site", "Probability", "Error left", "ln evidence"), [
        (
            effect_heading(one.effect),
            one.site,
            chance(one.probability),
            "–" if one.gap is None else percent(one.gap),
            "–" if one.log_evidence is None else f"{one.log_evidence:.1f}",
        )
        for one in found.ranking[:count]
    ]


def parameter_table(found: Diagnosis) -> Table:
    """Parameters that moved, and those that the log doesn't determine, which were held."""
    rows = [
        (name, _nominal(number), engineering(number.value, number.std, number.unit), _change(number))
        for name, number in found.tuned_parameters.items()
        if number.std is None or _has_moved(number)
    ]
    return ("Parameter", "Nominal", "Tuned", "Change"), rows


def cause_table(found: Diagnosis) -> Table:
    """Every parameter of every cause."""
    rows = [
        (effect_heading(cause.effect), cause.site, name.replace("_", " "), _value(number))
        for cause in found.causes
        for name, number in cause.parameters.items()
    ]
    return ("Effect", "Site", "Parameter", "Value"), rows


def distortion_table(found: Diagnosis) -> Table:
    """Split of each output's power under a periodic input."""
    return ("Output", "Linear", "Even", "Odd", "Noise"), [
        (one.output, percent(one.linear), percent(one.even), percent(one.odd), percent(one.noise))
        for one in found.distortion
    ]


def _value(number: FittedNumber) -> str:
    if number.std is None:
        return f"{engineering(number.value, None, number.unit)} (held)"
    # Such as a constant force that only accelerometers saw: its value would be read, its sigma not.
    wide = number.std > WIDE * abs(number.value)
    return "not determined" if wide else engineering(number.value, number.std, number.unit)


def _nominal(number: FittedNumber) -> str:
    return "–" if number.nominal is None else engineering(number.nominal, None, number.unit)


def _has_moved(number: FittedNumber) -> bool:
    if number.nominal is None:
        return True
    change = abs(number.value - number.nominal)
    # A sigma of nearly zero, or one as wide as the value, must not decide alone.
    return change > min(MOVED * abs(number.nominal), number.std or 0.0)


def _change(number: FittedNumber) -> str:
    if number.std is None:
        return "held: not determined"
    if not number.nominal:
        return "–"
    return f"{100 * (number.value / number.nominal - 1):+.2g} %"
