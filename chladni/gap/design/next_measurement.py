"""The next measurement, as a sentence."""

from collections.abc import Collection, Sequence

from chladni.gap.design.experiment import Change, Design
from chladni.gap.design.search import Search
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.diagnosis import PARAMETER, Candidate
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.model import Model
from chladni.models.effects.catalogue import spoken_effect
from chladni.signals.errors import EstimateError, ModelError
from chladni.signals.wording import listed


def next_measurement(
    study_model: Model,
    measurement: Measurement,
    tunables: Tunables,
    candidates: Sequence[Contestant],
    noise: NoiseFloor,
    *,
    seed: int,
) -> str | None:
    """Say which measurement would tell candidates apart that are still close.

    Every design is simulated with every candidate as fitted; each candidate is refitted to what the other predicts,
    and what is left is weighed as the contest weighs (after Hunter & Reiner 1965, Box & Hill 1967, Atkinson & Fedorov
    1975). The smallest change that tells them apart is named. There's None when there's nothing to tell apart.

    Parameters
    ----------
    candidates
        Two or more, fitted to this log, best first; the first three are compared.
    seed
        Of random excitations.
    """
    distinct = different(candidates)
    if len(distinct) < 2:
        return None
    try:
        search = Search(study_model, measurement, tunables, distinct, noise, seed=seed)
        designs = search.best()
    except (ModelError, EstimateError):
        # Candidates that can't be simulated even with the log's own inputs have no next measurement.
        return None
    return sentence(designs, distinct, search.tried)


def different(candidates: Sequence[Contestant]) -> list[Contestant]:
    """Give the best of those that name the same: variants of a law are one answer."""
    found: dict[tuple[Candidate, ...], Contestant] = {}
    for one in candidates:
        found.setdefault(one.hypothesis.named, one)
    return list(found.values())


def sentence(designs: Sequence[Design], candidates: Sequence[Contestant], tried: Collection[Change]) -> str | None:
    """Write designs, the one to do first in front, as one sentence, with the kinds of changes that were tried.

    There's None without a design, or when the model is right and nothing would tell of an effect that acts all the
    same.
    """
    if not designs:
        return None
    first, both = designs[0], _apart(candidates)
    now = f"{first.now_sigmas:.2g}"
    if not first.tells and not candidates[0].hypothesis.named:
        return None
    if not first.tells:
        return (
            f"Nothing that was tried ({_alternatives(tried)}) tells {both} apart: the best, '{first.words}', would "
            f"bring them to {first.sigmas:.2g} sigma (now {now}). Take them as one answer."
        )
    more = [f"; or {one.words[0].lower()}{one.words[1:]}: {one.sigmas:.2g} sigma" for one in designs[1:]]
    least = "at least " if len(candidates) > 2 else ""
    return f"{first.words}: {both} then differ by {least}{first.sigmas:.2g} sigma (now {now}){''.join(more)}."


def _alternatives(tried: Collection[Change]) -> str:
    """Say what was looked at."""
    words: dict[Change, str] = {
        "level": "levels up to 4 times",
        "repeats": "averages of up to 16 records",
        "band": "other bands",
        "sweep": "sweeps",
        "slow": "a slow sine",
        "sensor": "a further sensor",
        "position": "another place of the input",
    }
    return ", ".join(word for change, word in words.items() if change in tried)


def _apart(candidates: Sequence[Contestant]) -> str:
    """Names of the candidates that are to be told apart."""
    named = [_spoken(one) for one in candidates[:3]]
    if len(candidates[0].hypothesis.named) > 1:
        # Beside several causes one of them needs a word, or it reads as the first half of the others.
        words = [what if not site else f"{what} at {site} alone" for what, site in named]
        return listed(words)
    sites = {site for _, site in named}
    if len(sites) == 1 and "" not in sites:
        return f"{listed([what for what, _ in named])} at {sites.pop()}"
    return listed([f"{what} at {site}" if site else what for what, site in named])


def _spoken(candidate: Contestant) -> tuple[str, str]:
    """What a candidate names, and where, when that is one place."""
    named = candidate.hypothesis.named
    if not named:
        return "the model as it is", ""
    if len(named) == 1 and named[0].effect != PARAMETER:
        return spoken_effect(named[0].effect), named[0].site
    words = [_whole(one) for one in named]
    return " with ".join(words), ""


def _whole(one: Candidate) -> str:
    if one.effect == PARAMETER:
        return f"another value of {one.site}"
    return f"{spoken_effect(one.effect)} at {one.site}"
