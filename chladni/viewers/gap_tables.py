"""Rows of the tables that tell where a gap lies, what was weighed and what was tuned."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from chladni.gap.records.diagnosis import PARAMETER, Cause, Diagnosis, DistortionShare, FittedNumber, Ranked, Where
from chladni.models.effects.catalogue import CATALOGUE
from chladni.signals.engineering import (
    NOTHING,
    SURE,
    bounded_percent,
    chance,
    engineering,
    percent,
    signed_percent,
    span,
)
from chladni.viewers.effect_words import NOT_DETERMINED, cause_heading, effect_heading, printed_number

Table = tuple[Sequence[str], Sequence[Sequence[str]]]

# As many as one reads; the document holds all.
RANKED = 5
# A parameter that moved by less than its own sigma, and by less than this, didn't move.
MOVED = 1e-3
# What has a chance of less than this is printed as one that has none.
UNLIKELY = 1.0 - SURE
# Noise of less than this share of a gap needs no digits.
LITTLE = 0.01
# What a noise floor was estimated from, by its `NoiseFloor.method`.
NOISE_FROM = {
    "periods": "what differs between periods of the input",
    "quiet band": "the quietest part of the band",
    "fit residual": "what no linear response to the inputs explains",
    "incoherent residual": "what no linear response to the inputs explains and no other output shares",
    "explained residual": "what the best explanation leaves",
}


def channel_table(where: Where) -> Table:
    """Gap and noise of each output, over its own RMS; the largest first."""
    rows = sorted(where.channels, key=lambda one: -one.gap)
    return ("Output", "Gap", "Noise"), [
        (one.name, percent(one.gap), bounded_percent(one.noise, at_most=one.noise_at_most)) for one in rows
    ]


def noise_told(where: Where) -> str | None:
    """Say what the noise of the outputs was estimated from; None when that isn't known."""
    outputs: dict[str, list[str]] = {}
    for one in where.channels:
        if one.noise_from:
            outputs.setdefault(NOISE_FROM.get(one.noise_from, one.noise_from), []).append(one.name)
    if not outputs:
        return None
    told = [way if len(outputs) == 1 else f"{way} ({', '.join(names)})" for way, names in outputs.items()]
    return f"Noise is estimated from {'; from '.join(told)}."


def where_told(found: Diagnosis) -> Where:
    """Give where the gap lies; of one that nothing explains, bands and regimes of what the best parameters leave."""
    if found.left is None:
        return found.where
    # Of a robot sites are shares of the torque that is missing, named or not, as its pictures show.
    sites = found.left.sites if found.machine is None else found.where.sites
    return replace(found.left, channels=found.where.channels, sites=sites)


def band_table(where: Where, *, least: float = 0.0) -> Table:
    """Share of the gap's power in each band and how much of it noise can be, those with `least` and more."""
    rows = [
        (
            f"{one.low_hz:.4g} to {one.high_hz:.4g}",
            percent(one.share),
            _noise_share(one.noise),
        )
        for one in sorted(where.bands, key=lambda one: one.low_hz)
        if one.share >= least
    ]
    headings = ("Band [Hz]", "Share", "of it noise")
    # Of torques nothing says how noise spreads over bands: a column of dashes tells nothing.
    known = any(one.noise is not None for one in where.bands)
    return (headings, rows) if known else (headings[:2], [row[:2] for row in rows])


def site_title(found: Diagnosis, model: str = "What one site alone can explain") -> str:
    """Title of what sites are worth: of a robot the joints' own shares."""
    return model if found.machine is None else "Of the torque that is missing, by joint"


def force_title(found: Diagnosis, site: str) -> str:
    """Title of a restoring force: where nothing is missing it's no evidence of a site."""
    if found.verdict == "none":
        return f"Force recovered at {site}: nothing is missing, this is noise and what tuning moved"
    return f"Force that the model lacks at {site}"


def sites_named(found: Diagnosis) -> set[str]:
    """Sites of the causes; both of a pair, and what a wrong value is a value of."""
    sites = {site for cause in found.causes for site in (cause.site, *cause.site.split("~"))}
    return sites | {cause.site.rpartition(".")[0] for cause in found.causes if cause.effect == PARAMETER}


def site_table(where: Where, *, count: int | None = None) -> Table:
    """Share of the gap that an unknown force at each site explains; the largest first, at most `count`."""
    rows = [(", ".join(names), percent(share)) for names, share in places_of(where)[:count]]
    if where.pair is not None:
        # Above those that explain less alone.
        rows.insert(0, (" and ".join(", ".join(names) for names in where.pair.groups), percent(where.pair.share)))
    return ("Site", "Explains"), rows


def places_of(where: Where) -> list[tuple[tuple[str, ...], float]]:
    """Sites that these sensors can't tell apart, put together, with their share; the largest first.

    None where no site explains anything: a list of zeros would look like a place.
    """
    if not any(one.share >= NOTHING for one in where.sites):
        return []
    found: dict[frozenset[str], tuple[tuple[str, ...], float]] = {}
    for one in sorted(where.sites, key=lambda one: -one.share):
        names = (one.name, *one.group)
        found.setdefault(frozenset(names), (names, one.share))
    return list(found.values())


def regime_table(where: Where, *, least: float = 0.0) -> Table:
    """Share of the gap's power in each regime and of time, those with `least` and more; largest first."""
    rows = sorted(where.regimes, key=lambda one: -one.share)
    return ("While", "is between", "Share", "of time"), [
        (
            one.variable,
            span(one.low, one.high, one.unit),
            percent(one.share),
            _share(one.time),
        )
        for one in rows
        if one.share >= least
    ]


def time_table(where: Where, *, least: float = 0.0) -> Table:
    """Share of the gap's power in each stretch of the record, those with `least` and more; the largest first."""
    rows = sorted(where.times, key=lambda one: -one.share)
    return ("Time [s]", "Share"), [
        (f"{one.start_s:.4g} to {one.end_s:.4g}", percent(one.share)) for one in rows if one.share >= least
    ]


def ranking_table(found: Diagnosis, *, count: int = RANKED) -> Table:
    """Candidates by falling probability, those with hardly any by evidence; last what is left to others."""
    rows = [
        (
            effect_heading(one.effect),
            _place(one),
            chance(one.probability),
            "–" if one.gap is None else percent(one.gap),
            "–" if one.log_evidence is None else f"{one.log_evidence:.1f}",
        )
        for one in sorted(found.ranking, key=_standing)[:count]
    ]
    # Causes that act together share their probability: their sum tells nothing of the others.
    others = 1.0 - sum(one.probability for one in found.ranking)
    if rows and len(found.causes) < 2 and others >= UNLIKELY:
        rows.append(("none of these", "–", chance(others), "–", "–"))
    return ("Effect", "Site", "Probability", "Error left", "ln evidence"), rows


def _place(one: Ranked) -> str:
    """Site, and what else the row's numbers are of."""
    others = ", ".join(f"{effect_heading(each.effect)} at {each.site}" for each in one.beside)
    return f"{one.site} (with {others})" if others else one.site


def _standing(one: Ranked) -> tuple[float, float]:
    """Sort key by what is printed: a column of "under 1 %" would look unordered by its hidden digits."""
    evidence = -inf if one.log_evidence is None else one.log_evidence
    return -one.probability if one.probability >= UNLIKELY else 0.0, -evidence


def parameter_table(found: Diagnosis) -> Table:
    """Parameters that moved, and those that the log doesn't determine."""
    rows = [
        (name, _nominal(number), engineering(number.value, number.std, number.unit), _change(number))
        for name, number in found.tuned_parameters.items()
        # Of a robot's many links it's no news that a log doesn't tell the masses.
        if _has_moved(number) or (number.std is None and found.machine is None)
    ]
    return ("Parameter", "Nominal", "Tuned", "Change"), rows


def cause_table(found: Diagnosis) -> Table:
    """Every parameter of every cause, with the form of its law."""
    rows = [
        (cause_heading(cause), cause.site, name.replace("_", " "), _value(cause, name, number))
        for cause in found.causes
        for name, number in cause.parameters.items()
    ]
    return ("Effect", "Site", "Parameter", "Value"), rows


def distortion_table(found: Diagnosis) -> Table:
    """Split of each output's power under a periodic input; even and odd together where they can't be told apart."""
    even = _even_told(found.distortion)
    return ("Output", *_parts_named(even)), [(one.output, *_parts(one, even=even)) for one in found.distortion]


def distortion_title(shares: Sequence[DistortionShare]) -> str:
    """What the table of distortion tells."""
    return "Linear, even, odd and noise" if _even_told(shares) else "Linear, nonlinear and noise"


def split_table(measured: Sequence[DistortionShare], simulated: Sequence[DistortionShare]) -> Table:
    """Split of each output's power under a periodic input, of the measured and the simulated log."""
    even = _even_told(measured)
    return ("Output", "Log", *_parts_named(even)), [
        (one.output, log, *_parts(one, even=even))
        for pair in zip(measured, simulated, strict=True)
        for log, one in zip(("measured", "simulated"), pair, strict=True)
    ]


def _even_told(shares: Sequence[DistortionShare]) -> bool:
    return all(one.even is not None for one in shares)


def _parts_named(even: bool) -> tuple[str, ...]:
    return ("Linear", "Even", "Odd", "Noise") if even else ("Linear", "Nonlinear", "Noise")


def _parts(one: DistortionShare, *, even: bool) -> tuple[str, ...]:
    between = (_share(one.even), _share(one.odd)) if even else (percent(one.nonlinear),)
    return percent(one.linear), *between, percent(one.noise)


def _noise_share(share: float | None) -> str:
    # Digits of next to nothing only hide those that count.
    return f"under {100 * LITTLE:.0f} %" if share is not None and share < LITTLE else _share(share)


def _share(share: float | None) -> str:
    return "–" if share is None else percent(share)


def _value(cause: Cause, name: str, number: FittedNumber) -> str:
    held = number.std is None and not _is_read(cause)
    return printed_number(cause, name) + (" (held)" if held else "")


def _is_read(cause: Cause) -> bool:
    """Whether a cause's numbers are read off signals and not fitted: that no spread is known says nothing then."""
    kind = CATALOGUE.get(cause.effect)
    return kind is not None and (kind.clues.in_samples is not None or kind.clues.of_force is not None)


def _nominal(number: FittedNumber) -> str:
    return "–" if number.nominal is None else engineering(number.nominal, None, number.unit)


def _has_moved(number: FittedNumber) -> bool:
    if number.nominal is None:
        return True
    change, least = abs(number.value - number.nominal), MOVED * abs(number.nominal)
    # A sigma of nearly zero, or one as wide as the value, must not decide alone.
    return change > (least if number.std is None else min(least, number.std))


def _change(number: FittedNumber) -> str:
    moved = signed_percent(number.value / number.nominal - 1) if number.nominal and _has_moved(number) else ""
    if number.std is not None:
        return moved or "–"
    # What the log doesn't tell may move all the same, within its tolerance, where others that it depends on do.
    return f"{moved}, {NOT_DETERMINED}" if moved else NOT_DETERMINED
