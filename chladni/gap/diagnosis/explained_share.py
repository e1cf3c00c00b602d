"""How much of the gap each named cause explains."""

from collections.abc import Sequence
from dataclasses import replace

from chladni.gap.diagnosis.closing import explained_power
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.records.diagnosis import Candidate, Cause, Closing


def with_shares(causes: Causes, said: Sequence[Cause], gap: Closing) -> tuple[Cause, ...]:
    """Give the causes that a verdict names with their shares of the gap; see `Cause`.

    One cause has all that is explained. Of several each has what comes back when only the others are named, by the
    best fit of those; without such a fit nothing tells.
    """
    return tuple(replace(one, share=_share(causes, one, gap)) for one in said)


def _share(causes: Causes, cause: Cause, gap: Closing) -> float | None:
    if causes.shaken is not None:
        return gap.explained
    candidate, named = Candidate(effect=cause.effect, site=cause.site), set(causes.best.hypothesis.named)
    # A sensor's steps were told by what it reads, not by a fit.
    if gap.explained is None or candidate not in named:
        return None
    others = named - {candidate}
    if not others:
        return gap.explained
    left = next((one.gap for one in causes.ranked if set(one.hypothesis.named) == others), None)
    return None if left is None else explained_power(left, gap.tuned, gap.after, noise=gap.noise)
