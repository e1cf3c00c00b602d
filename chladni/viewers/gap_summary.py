"""A diagnosis in sentences that read as an answer."""

from collections.abc import Iterator

from chladni.gap.records.diagnosis import PARAMETER, Cause, Closing, Diagnosis, FittedNumber
from chladni.gap.records.measurement import LogUse
from chladni.gap.records.robot import site_words
from chladni.signals.engineering import bounded_percent, chance, engineering, percent
from chladni.signals.wording import counted
from chladni.viewers.effect_words import cause_phrase, effect_at, effect_heading
from chladni.viewers.gap_tables import places_of
from chladni.viewers.robot_summary import IN_A_SENTENCE, listed, robot_sentences, robot_unknown

# Above the first one says "most likely", above the second "probably", else "perhaps".
LIKELY, PROBABLE = 0.9, 0.6
# An error of less than so many times the noise makes any name uncertain.
FAINT = 3.0
# Candidates that are named when none explains the gap.
NEAREST = 3
# Of what closes on the first log, the share below which little carries over to another.
CARRIED = 0.5
# Of what any force at a place explains, the share above which a law that follows the motion there does it.
_FOLLOWED = 0.95
_LEFT = "what the best parameters leave"
#: A share of power beyond the noise, as docs/gap.md says; the sentence that it stands in must stay an answer.
_LEFT_BY_TUNING = "of the gap that tuning leaves"


def summary(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Say what was found: the answer first, then how far it goes, what else it may be and what limits it.

    Returns
    -------
    tuple of str
        Sentences for a terminal, a report, a picture's title; plain text. The first one is the answer.
    """
    return tuple(_sentences(diagnosis))


def headline(diagnosis: Diagnosis) -> str:
    """Give the answer alone, in one sentence."""
    return summary(diagnosis)[0]


def caveats(found: Diagnosis) -> tuple[str, ...]:
    """Those sentences of the summary, in its order, without which its first two say more than was found."""
    causes = found.causes if found.verdict in ("effect", "parameters") else ()
    told = {
        *_faint(found),
        *(one for cause in causes for one in _reservations(cause)),
        *(_too_near(found.gap) if causes else ()),
        *_elsewhere(found),
        *_how(found),
        *filter(None, (found.advice,)),
    }
    return tuple(sentence for sentence in summary(found) if sentence in told)


def naive_sentence(found: Diagnosis) -> str | None:
    """Say what the largest drop of the error alone would have named, where that is something else."""
    naive = found.naive
    # Where it agrees there is nothing to warn of.
    if naive is None or (naive.effect, naive.site) in {(cause.effect, cause.site) for cause in found.causes}:
        return None
    return f"The largest drop of the error alone would have named {effect_at(naive.effect, naive.site)}."


def used_length(one: LogUse) -> str:
    """Give the seconds of a log that were used, and of how many, where that isn't all."""
    # Less than a sample is rounding.
    whole = (one.recorded_s - one.used_s) * one.sample_rate_hz < 1
    return f"{one.used_s:.5g} s" if whole else f"{one.used_s:.5g} s of the {one.recorded_s:.5g} s"


def _sentences(found: Diagnosis) -> Iterator[str]:
    match found.verdict:
        case "effect":
            yield from _effects(found)
        case "parameters":
            yield from _parameters(found)
        case "none":
            yield f"Nothing is missing: {_agreement(found.gap)}."
            yield from _nowhere(found)
            yield from _moved(found)
        case "unknown":
            yield from _unknown(found) if found.machine is None else robot_unknown(found)
    # Where nothing was named, or added to the model, nothing closes.
    if found.verdict in ("effect", "parameters"):
        if found.verdict == "parameters" or found.gap.after != found.gap.tuned:
            yield from _closed(found)
        yield from _elsewhere(found)
    yield from _how(found)
    if found.advice:
        yield found.advice


def _effects(found: Diagnosis) -> Iterator[str]:
    causes = found.causes
    if found.machine is not None:
        yield from robot_sentences(found)
    elif len(causes) == 1:
        (cause,) = causes
        yield f"{_certainty(cause)} {cause_phrase(cause)} ({chance(cause.probability)})."
    else:
        # Two names are as sure as the less sure one.
        least = min(causes, key=lambda cause: cause.probability)
        told = listed([f"{cause_phrase(cause)} ({chance(cause.probability)})" for cause in causes])
        yield f"{_certainty(least)} {_COUNT.get(len(causes), 'several')} causes at once: {told}."
    yield _closing(found)
    yield from _shares(found)
    yield from _any_law(found)
    yield from _faint(found)
    for cause in causes:
        yield from _reservations(cause)


def _any_law(found: Diagnosis) -> Iterator[str]:
    """What a law of the motion at one place explains, whatever its name."""
    law = found.any_law
    if law is None:
        return
    site = listed((law.site, *law.group), word="or")
    if law.named is not None:
        yield (
            f"Any smooth law of what moves at {site} explains {percent(law.law)} of {_LEFT}, "
            f"the named one {percent(law.named)}."
        )
    elif law.law > _FOLLOWED * law.force:
        yield (
            f"A smooth law of what moves at {site} explains {percent(law.law)} of {_LEFT}: none that took part does."
        )
    else:
        yield (
            f"Any smooth law of what moves at {site} explains {percent(law.law)} of {_LEFT}, any force there "
            f"{percent(law.force)}: what acts has a memory, follows something else, or acts elsewhere, too."
        )


def _faint(found: Diagnosis) -> Iterator[str]:
    if found.gap.before < FAINT * found.gap.noise:
        noise = "what noise may be" if found.gap.noise_at_most else "the noise"
        yield f"The gap is faint: the error is {found.gap.before / found.gap.noise:.2g} times {noise}."


_COUNT = {2: "two", 3: "three", 4: "four"}


def _certainty(cause: Cause) -> str:
    if cause.probability >= LIKELY:
        return "Most likely"
    return "Probably" if cause.probability >= PROBABLE else "Perhaps"


def _closing(found: Diagnosis) -> str:
    gap = found.gap
    if gap.after == gap.tuned:
        # What a sensor's own samples tell, steps and constants, changes no run.
        return f"Beside {'it' if len(found.causes) == 1 else 'them'}, {_agreement(gap)}."
    subject = "It explains" if len(found.causes) == 1 else "Together they explain"
    explained = "" if gap.explained is None else f"{subject} {percent(gap.explained)} {_LEFT_BY_TUNING}; "
    adding = "adding it brings" if len(found.causes) == 1 else "adding them brings"
    # Tables of the whole log show other numbers.
    brings = f"{adding} the error from {percent(gap.before)} to {percent(gap.after)} on stretches that no fit saw"
    text = f"{explained}{brings}, noise {_noise(gap)}."
    return text if explained else text[0].upper() + text[1:]


def _shares(found: Diagnosis) -> Iterator[str]:
    """What each of several causes is worth beside the others."""
    if len(found.causes) > IN_A_SENTENCE:
        # Tables hold them.
        return
    told = [
        f"without {effect_at(cause.effect, cause.site)} {percent(cause.share)} of it"
        for cause in found.causes
        if cause.share is not None
    ]
    if len(found.causes) > 1 and told:
        sentence = f"{listed(told)} comes back."
        yield sentence[0].upper() + sentence[1:]


def _elsewhere(found: Diagnosis) -> Iterator[str]:
    """Other logs, judged with what the first one told."""
    for gap in found.elsewhere:
        log = gap.held_out[0].log if gap.held_out else "another log"
        brings = f"from {percent(gap.before)} to {percent(gap.after)}, noise {_noise(gap)}"
        yield f"On {log}, which nothing was fitted to, the error goes {brings}{_carried(found.gap, gap)}."


def _carried(here: Closing, there: Closing) -> str:
    """What is said where less closes on another log than on the first."""
    if there.after >= there.before:
        return ": what was found doesn't carry over"
    if there.closed is not None and here.closed is not None and there.closed < CARRIED * here.closed:
        return ": little of what was found carries over"
    return ""


def _reservations(cause: Cause) -> Iterator[str]:
    others = [site_words(site) for site in cause.group if site != cause.site]
    if others:
        yield f"These sensors can't tell {site_words(cause.site)} from {listed(others, word='or')}."
    if cause.alternatives:
        told = listed([effect_at(one.effect, one.site) for one in cause.alternatives], word="or")
        whose = f": {chance(cause.probability)} is that of its family there" if cause.probability_of else ""
        yield f"This log can't tell {effect_heading(cause.effect)} at {site_words(cause.site)} from {told}{whose}."


def _parameters(found: Diagnosis) -> Iterator[str]:
    wrong = [cause for cause in found.causes if cause.effect == PARAMETER]
    if found.machine is not None:
        yield from robot_sentences(found)
    else:
        told = listed([_wrong_value(cause, found) for cause in wrong])
        yield f"Nothing is missing, but {told}: more than the stated tolerance allows."
    gap = found.gap
    yield (
        f"With that the error falls from {percent(gap.before)} to {percent(gap.after)} on stretches that no fit saw, "
        f"noise {_noise(gap)}."
    )
    for cause in wrong:
        yield from _reservations(cause)


def _wrong_value(cause: Cause, found: Diagnosis) -> str:
    # The tuned value knows its nominal one, the cause's own may not.
    number = found.tuned_parameters.get(cause.site) or next(iter(cause.parameters.values()), None)
    if number is None:
        return f"{cause.site} has another value ({chance(cause.probability)})"
    return f"{cause.site} is {_against_nominal(number)} ({chance(cause.probability)})"


def _against_nominal(number: FittedNumber) -> str:
    told = engineering(number.value, number.std, number.unit)
    if number.nominal is None:
        return told
    return f"{told} where the model has {engineering(number.nominal, None, number.unit)}"


def _nowhere(found: Diagnosis) -> Iterator[str]:
    """That places were looked at, where tables and pictures of them would be of zeros."""
    if found.where.sites and not places_of(found.where):
        count = counted(len({frozenset((one.name, *one.group)) for one in found.where.sites}), "place")
        yield f"No force, error or change at any of {count} explains anything beyond the noise."


def _moved(found: Diagnosis) -> Iterator[str]:
    """The tuned value that lies farthest from its nominal, in words; tables hold the others."""
    moved = {
        name: number
        for name, number in found.tuned_parameters.items()
        if number.std is not None and number.nominal and number.value != number.nominal
    }
    if moved:
        name = max(moved, key=lambda one: abs(moved[one].value / (moved[one].nominal or 1.0) - 1))
        yield f"Tuned inside its tolerance, {name} is {_against_nominal(moved[name])}; that changed most."


def _agreement(gap: Closing) -> str:
    tuned = "" if gap.tuned == gap.before else f" ({percent(gap.before)} before its parameters were tuned)"
    return f"the model's error is {percent(gap.after)}{tuned}, the noise {_noise(gap)}"


def _noise(gap: Closing) -> str:
    return bounded_percent(gap.noise, at_most=gap.noise_at_most)


def _unknown(found: Diagnosis) -> Iterator[str]:
    gap = found.gap
    yield (
        f"There is a gap that no known effect explains: the best parameters leave an error of {percent(gap.tuned)} "
        f"({percent(gap.before)} before), noise {_noise(gap)}."
    )
    where = found.left or found.where
    told = []
    if where.sites:
        site = max(where.sites, key=lambda one: one.share)
        names = listed((site.name, *site.group), word="or")
        told.append(f"{percent(site.share)} of what they leave can come from {names}")
    if where.bands:
        band = max(where.bands, key=lambda one: one.share)
        # With one sensor there is no site to begin with.
        of_it = " of it" if told else " of what they leave"
        told.append(f"{percent(band.share)}{of_it} lies between {band.low_hz:.4g} and {band.high_hz:.4g} Hz")
    if told:
        yield f"{', and '.join(told)}."
    yield from _any_law(found)
    nearest = [effect_at(one.effect, one.site) for one in found.ranking[:NEAREST]]
    if nearest:
        yield f"Nearest, but not good enough: {', '.join(nearest)}."


def _closed(found: Diagnosis) -> Iterator[str]:
    """How sure the share that closes is, or that nothing can be said of it."""
    gap = found.gap
    yield from _too_near(gap)
    if gap.closed is not None and gap.interval is not None:
        low, high = (percent(end).removesuffix(" %") for end in gap.interval)
        adding = "Adding it" if len(found.causes) == 1 else "Adding them"
        yield f"{adding} closes {percent(gap.closed)} of the gap above the noise (95 % interval {low} to {high} %)."


def _too_near(gap: Closing) -> Iterator[str]:
    if gap.closed is None:
        yield "The gap is too near to the noise to say which share of it closes."


def _how(found: Diagnosis) -> Iterator[str]:
    """How the closing was measured, where it wasn't by free run."""
    gap = found.gap
    if gap.by == "cross_sensor":
        yield "The cause isn't among the log's inputs: the closing is that of each sensor predicted from the others."
    elif gap.by == "torque":
        yield "Errors are those of the joints' torques: what the drives give against what the motion needs."
    elif gap.by == "windows" and gap.horizon_s is not None:
        span = engineering(gap.horizon_s, None, "s")
        if found.machine is not None:
            yield f"Errors are those of simulated positions over the motion, in runs of {span} from the log's poses."
            return
        yield f"Errors are those of windows of {span}, each from an estimated state; beyond, they drift apart."
