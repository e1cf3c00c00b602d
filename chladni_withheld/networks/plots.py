"""What cases of all kinds are made of: a scene, what is hidden in it, what its model states wrongly."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from chladni_withheld.case import PARAMETER, Kind
from chladni_withheld.networks.hiding import (
    CLEAR,
    DRAFTS,
    LEAST,
    MOST,
    OUTSIDE_DRAFTS,
    Hidden,
    RefusedError,
    clear,
    distinct,
    draw_draft,
    hide,
    settle,
    yardstick,
)  # fmt: skip
from chladni_withheld.networks.linear_view import LinearView
from chladni_withheld.networks.network import Joint, Network
from chladni_withheld.networks.rivals import Rivals
from chladni_withheld.networks.scene import Rng, Scene, draw_scene

if TYPE_CHECKING:
    from chladni_withheld.networks.draft import Draft
    from chladni_withheld.networks.machine import Addition

_LEAST_OFF = 5.0
"""Sigma that a wrong number is off at least, where a verdict begins at three."""
# Words that no other word imitates, so that with theirs gone nothing right is left to say.
_ALONE = (
    "quadratic_damping", "backlash", "one_sided_stop", "varying_stiffness", "extra_mode", "missing_link",
    "rate_limit", "dead_zone", "ripple", "cross_axis", "ac_coupling", "clipping", "base_vibration", "unbalance",
    "harmonics",
)  # fmt: skip
# Words whose size can be small; a swap, a sign or a unit can't.
_SMALL = tuple(word for word in DRAFTS if word not in ("swapped_channels", "added_mass", "missing_link"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """What a case is made of, before it's written.

    Attributes
    ----------
    scene, hidden
        The machine, and what is hidden in it.
    stated
        The network that the model file states: nominal, but for what is wrong.
    wrong
        Names of wrong numbers.
    leave_out
        See `chladni_withheld.case.WithheldCase`.
    further
        More for the truth.
    """

    scene: Scene
    stated: Network
    hidden: tuple[Hidden, ...] = ()
    wrong: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()
    further: Mapping[str, object] = field(default_factory=dict)

    @property
    def additions(self) -> "tuple[Addition, ...]":
        """What is hidden, as additions to the machine."""
        return tuple(hidden.made.addition for hidden in self.hidden)


def _word(seed: int, index: int, words: Sequence[str], turn: int = 0) -> str:
    """The words in a random order that the seed gives, one after another by the index."""
    order = np.random.default_rng((seed, len(words), turn)).permutation(len(words))
    return words[int(order[index % len(words)])]


def _wanted(rng: Rng, least: float = 7.0, most: float = 150.0) -> float:
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def _plot_effect(rng: Rng, seed: int, index: int) -> Plot:
    return with_word(rng, _word(seed, index, tuple(DRAFTS)))


def with_word(rng: Rng, word: str) -> Plot:
    """Hide one clear effect of that word."""
    scene = draw_scene(rng)
    hidden = hide(scene, draw_draft(rng, scene, word), _wanted(rng))
    plot = Plot(scene=scene, stated=scene.nominal, hidden=(hidden,))
    return _link_apart(plot) if word == "missing_link" else plot


def _plot_outside(rng: Rng, seed: int, index: int) -> Plot:
    return with_word(rng, _word(seed, index, tuple(OUTSIDE_DRAFTS)))


def _plot_leave_out(rng: Rng, seed: int, index: int) -> Plot:
    word = _word(seed, index, _ALONE)
    return replace(with_word(rng, word), leave_out=(word,))


def _plot_topology(rng: Rng, _: int, __: int) -> Plot:
    return with_word(rng, "missing_link")


def _plot_faint(rng: Rng, seed: int, index: int) -> Plot:
    scene = draw_scene(rng)
    draft = draw_draft(rng, scene, _word(seed, index, _SMALL))
    if draft.fixed:
        raise RefusedError(f"{draft.word}: never small")
    begin, smallest, largest = draft.sizes
    small = replace(draft, sizes=(begin, 1e-3 * smallest, largest), acting=(0.0, 1.0))
    hidden = settle(scene, small, (), _wanted(rng, 0.3, 2.5), 0.1, CLEAR)
    return Plot(scene=scene, stated=scene.nominal, hidden=(hidden,))


def _plot_none(rng: Rng, _: int, index: int) -> Plot:
    """Band-limited and held in turn, with 0.3 and 1 % of noise in turn."""
    scene = draw_scene(rng, hold=("band_limited", "zoh")[index % 2], noise=(0.003, 0.01)[index // 2 % 2])
    return Plot(scene=scene, stated=scene.nominal)


def _plot_two(rng: Rng, seed: int, index: int) -> Plot:
    return _several(rng, seed, index, 2)


def _plot_three(rng: Rng, seed: int, index: int) -> Plot:
    return _several(rng, seed, index, 3)


def _several(rng: Rng, seed: int, index: int, count: int) -> Plot:
    """Effects at places of their own, each of which matters beside the others."""
    scene = draw_scene(rng)
    if len(scene.network.joints) + len(scene.network.sensors) < 3 + count:
        raise RefusedError("several: machine too small")
    drafts: list[Draft] = []
    for turn in range(count):
        words = tuple(word for word in DRAFTS if word not in {"missing_link", *(draft.word for draft in drafts)})
        word = _word(seed, index, words, turn + 1)
        drafts.append(draw_draft(rng, scene, word, [draft.site for draft in drafts]))
    found: tuple[Hidden, ...] = ()
    for draft in drafts:
        among = tuple(hidden.made.addition for hidden in found)
        hidden = settle(scene, draft, among, _wanted(rng, 25.0, 150.0), LEAST, MOST)
        found = (*found, distinct(scene, hidden, (*among, hidden.made.addition), among))
    return Plot(scene=scene, stated=scene.nominal, hidden=_each_clear(scene, found))


def _each_clear(scene: Scene, found: tuple[Hidden, ...]) -> tuple[Hidden, ...]:
    """Check each effect beside all others, where it may matter less than it did before these came."""
    every = tuple(hidden.made.addition for hidden in found)
    return tuple(
        clear(scene, hidden, every, tuple(addition for addition in every if addition is not hidden.made.addition))
        for hidden in found
    )


def _plot_parameters(rng: Rng, _: int, __: int) -> Plot:
    """One number a few sigma off."""
    scene = draw_scene(rng)
    name = str(rng.choice(list(scene.tolerances)))
    return _wrong_plot(rng, scene, {name: 1 + rng.uniform(5, 12) * scene.tolerances[name]})


def _plot_value(rng: Rng, _: int, __: int) -> Plot:
    """One to three numbers wrong, by a factor of up to ten; one in three is a slip of the decimal point."""
    scene = draw_scene(rng)
    count = int(rng.choice([1, 2, 3], p=[0.55, 0.3, 0.15]))
    names = [str(name) for name in rng.permutation(list(scene.tolerances))[:count]]
    slips = rng.random(count) < 1 / 3
    factors = np.where(slips, 10.0, np.exp(rng.uniform(np.log(1.5), np.log(10.0), count)))
    return _wrong_plot(rng, scene, dict(zip(names, factors.tolist(), strict=True)))


def _plot_value_and_effect(rng: Rng, seed: int, index: int) -> Plot:
    scene = draw_scene(rng)
    words = tuple(word for word in DRAFTS if word not in ("added_mass", "missing_link", "gain_error"))
    draft = draw_draft(rng, scene, _word(seed, index, words))
    name = str(rng.choice(list(scene.tolerances)))
    if draft.site == name.rsplit(".", 1)[0]:
        raise RefusedError("value_and_effect: site taken")
    wrong = _wrong_plot(rng, scene, {name: _wanted(rng, 1.5, 5.0)})
    return replace(wrong, hidden=(hide(scene, draft, _wanted(rng)),))


def _wrong_plot(rng: Rng, scene: Scene, factors: Mapping[str, float]) -> Plot:
    """State numbers wrongly by factors, and check that each has to be found, and that no single one does for all."""
    stated = {name: _stated(rng, scene, name, factor) for name, factor in factors.items()}
    groups = [{name: value} for name, value in stated.items()]
    groups += [stated] if len(stated) > 1 else []
    nearest = [_nearest(scene, group, scene.network, () if len(group) > 1 else tuple(group)) for group in groups]
    further = {"nearest_number_or_link": [{"left": left, "name": name} for left, name in nearest]}
    return Plot(scene=scene, stated=scene.nominal.with_numbers(stated), wrong=tuple(stated), further=further)


def _stated(rng: Rng, scene: Scene, name: str, factor: float) -> float:
    """A number that is wrong by a factor, too large or too small, and five sigma off at least."""
    true, tolerance = scene.network.numbers()[name], scene.tolerances[name]
    inside = 1 - 1 / factor < _LEAST_OFF * tolerance
    # A body that is heavier than stated is an added mass, so a wrong mass is stated too large.
    if name.endswith(scene.network.mass_word):
        if inside:
            raise RefusedError(f"{PARAMETER}: inside its tolerance")
        return true * factor
    return true / max(factor, 1 + _LEAST_OFF * tolerance) if inside or rng.random() < 0.5 else true * factor


def _link_apart(plot: Plot) -> Plot:
    """Check that no number and no other link does for a missing link."""
    scene, hidden = plot.scene, plot.hidden[0]
    link = hidden.made.addition.links[0]
    numbers = {"stiffness": link.stiffness, "damping": link.damping}
    joint = Joint(name="missing", first=link.first, second=link.second, **numbers)
    linked = replace(scene.network, joints=(*scene.network.joints, joint))
    left, name = _nearest(scene, {}, linked, (hidden.draft.site,))
    return replace(plot, further={"nearest_number_or_link": [{"left": left, "name": name}]})


def _nearest(scene: Scene, stated: Mapping[str, float], true: Network, without: Sequence[str]) -> tuple[float, str]:
    """What the best single number or link leaves over the noise, where the model states some numbers wrongly."""
    base, truth = _view_of(scene, scene.network.with_numbers(stated)), _view_of(scene, true)
    pause = max(base.dying, truth.dying)
    base, truth = replace(base, pause=pause), replace(truth, pause=pause)
    log = truth.log()
    measure, lines = yardstick(scene, log), base.below_half
    ratio = measure.ratio(log - base.log())
    if ratio < LEAST:
        raise RefusedError("number or link: too little")
    change = truth.outputs[:, :lines] - base.outputs[:, :lines]
    rivals = Rivals(base=base, truth=change, steps=measure.steps, weights=measure.weights, ratio=ratio)
    left, name = rivals.nearest(frozenset(without))
    if left < CLEAR:
        raise RefusedError("number or link: like another")
    return round(left, 2), name


def _view_of(scene: Scene, network: Network) -> LinearView:
    return LinearView(network=network, grid=scene.grid, drives=scene.drives)


PLOTS: Mapping[Kind, Callable[[Rng, int, int], Plot]] = {
    "effect": _plot_effect,
    "none": _plot_none,
    "parameters": _plot_parameters,
    "two": _plot_two,
    "three": _plot_three,
    "faint": _plot_faint,
    "leave_out": _plot_leave_out,
    "outside": _plot_outside,
    "topology": _plot_topology,
    "value": _plot_value,
    "value_and_effect": _plot_value_and_effect,
}
