"""The document of ``chladni gap``: what was found, as JSON."""

from collections.abc import Mapping
from math import isfinite
from typing import Final

from chladni.gap.records.diagnosis import (
    AnyLaw,
    Candidate,
    Cause,
    Closing,
    Correlation,
    Diagnosis,
    DistortionShare,
    FittedNumber,
    PairShare,
    Ranked,
    Where,
)

Document = dict[str, object]
GAP_FORMAT: Final = "chladni.gap/1"


def gap_document(found: Diagnosis) -> Document:
    """Give the document; numbers that aren't known are null.

    Returns
    -------
    Document
        ``format``, ``model``, ``logs``, ``verdict``, ``causes``, ``ranking``, ``where``, ``gap``,
        ``tuned_parameters`` and ``next_measurement`` always; ``naive``, ``advice``, ``remarks``, ``distortion``,
        ``levels``, ``elsewhere``, ``left``, ``correlation``, ``any_law``, ``set`` and ``coverage`` when there is
        something in them.
        docs/gap.md says what each means.
    """
    return {
        "format": GAP_FORMAT,
        "model": found.model,
        "logs": list(found.logs),
        "verdict": found.verdict,
        "causes": [_cause(cause) for cause in found.causes],
        "ranking": [_ranked(row) for row in found.ranking],
        "where": where_document(found.where),
        "gap": closing_document(found.gap),
        "tuned_parameters": {
            name: {"nominal": _known(number.nominal), **_number(number)}
            for name, number in found.tuned_parameters.items()
        },
        "next_measurement": found.next_measurement,
        **_when_there(
            {
                "naive": None if found.naive is None else _candidate(found.naive),
                "advice": found.advice,
                "remarks": list(found.remarks),
                "distortion": [distortion_document(one) for one in found.distortion],
                "levels": list(found.levels),
                "elsewhere": [closing_document(one) for one in found.elsewhere],
                "left": None if found.left is None else where_document(found.left),
                "correlation": None if found.correlation is None else _correlation(found.correlation),
                "any_law": None if found.any_law is None else _any_law(found.any_law),
                "set": [_candidate(one) for one in found.answer_set],
                "coverage": found.coverage if found.answer_set else None,
            }
        ),
    }


def where_document(where: Where) -> Document:
    """Give where the gap lies: by channel, band, site, regime and time."""
    return {
        "channels": [
            {
                "name": one.name,
                "gap": _known(one.gap),
                "noise": _known(one.noise),
                **_when_there({"noise_from": one.noise_from or None, "noise_at_most": one.noise_at_most or None}),
            }
            for one in where.channels
        ],
        "bands": [
            {
                "low_hz": _known(one.low_hz),
                "high_hz": _known(one.high_hz),
                "share": _known(one.share),
                **_when_there({"noise": _known(one.noise)}),
            }
            for one in where.bands
        ],
        "sites": [
            {"name": one.name, "share": _known(one.share), **_when_there({"group": list(one.group)})}
            for one in where.sites
        ],
        "regimes": [
            {
                "variable": one.variable,
                "low": _known(one.low),
                "high": _known(one.high),
                "share": _known(one.share),
                **_when_there({"time": _known(one.time)}),
            }
            for one in where.regimes
        ],
        "times": [
            {"start_s": _known(one.start_s), "end_s": _known(one.end_s), "share": _known(one.share)}
            for one in where.times
        ],
        **_when_there({"pair": None if where.pair is None else _pair(where.pair)}),
    }


def _pair(pair: PairShare) -> Document:
    return {"groups": [list(names) for names in pair.groups], "share": _known(pair.share)}


def closing_document(gap: Closing) -> Document:
    """Give how far the gap closes; ``by`` and ``horizon_s`` only when it wasn't by free run."""
    # A free run is what everyone expects; the key warns of anything else.
    document: Document = {
        "before": _known(gap.before),
        "tuned": _known(gap.tuned),
        "after": _known(gap.after),
        "noise": _known(gap.noise),
        "closed": _known(gap.closed),
        "interval": None if gap.interval is None else [_known(end) for end in gap.interval],
        "held_out": [{"log": one.log, "start_s": one.start_s, "end_s": one.end_s} for one in gap.held_out],
    }
    if gap.by != "free_run":
        document["by"] = gap.by
    known = {"horizon_s": gap.horizon_s, "explained": gap.explained, "after_over_noise": gap.after_over_noise}
    at_most = {"noise_at_most": gap.noise_at_most or None}
    return document | _when_there({**{key: _known(number) for key, number in known.items()}, **at_most})


def _cause(cause: Cause) -> Document:
    return {
        "effect": cause.effect,
        "site": cause.site,
        "probability": _known(cause.probability),
        "group": list(cause.group),
        "alternatives": [_candidate(one) for one in cause.alternatives],
        "parameters": {name: _number(number) for name, number in cause.parameters.items()},
        # "from" as in model files, where a cause may be pasted.
        **_when_there(
            {
                "variant": cause.variant,
                "from": cause.source,
                "share": _known(cause.share),
                "probability_of": list(cause.probability_of),
            }
        ),
    }


def _candidate(one: Candidate) -> Document:
    return {"effect": one.effect, "site": one.site}


def _ranked(row: Ranked) -> Document:
    return {
        "effect": row.effect,
        "site": row.site,
        "probability": _known(row.probability),
        "gap": _known(row.gap),
        "log_evidence": _known(row.log_evidence),
        **_when_there({"beside": [_candidate(one) for one in row.beside] or None}),
    }


def _number(number: FittedNumber) -> Document:
    return {"value": _known(number.value), "std": _known(number.std), "unit": number.unit}


def _correlation(one: Correlation) -> Document:
    return {"names": list(one.names), "matrix": [[_known(number) for number in row] for row in one.matrix]}


def _any_law(one: AnyLaw) -> Document:
    return {
        "site": one.site,
        "group": list(one.group),
        "force": _known(one.force),
        "law": _known(one.law),
        "named": _known(one.named),
    }


def distortion_document(one: DistortionShare) -> Document:
    """Give the split of one output's power."""
    return {
        "output": one.output,
        "linear": _known(one.linear),
        "even": _known(one.even),
        "odd": _known(one.odd),
        "noise": _known(one.noise),
        "nonlinear": _known(one.nonlinear),
    }


def _known(number: float | None) -> float | None:
    """Give a number as Python's own, None when there is none."""
    # A float whatever it was: integers would lose the dot that tells programs so.
    return None if number is None or not isfinite(number) else float(number)


def _when_there(entries: Mapping[str, object]) -> Document:
    return {key: entry for key, entry in entries.items() if entry is not None and entry != []}
