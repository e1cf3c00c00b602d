"""Hiding an effect in a scene: its size is sought until it matters, and is refused where it could be another."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni_withheld.networks import at_bodies, at_inputs, at_joints, at_outputs, outside
from chladni_withheld.networks.draft import Draft, Made
from chladni_withheld.networks.machine import Addition, converted
from chladni_withheld.networks.network import Matrix
from chladni_withheld.networks.scene import Rng, Scene
from chladni_withheld.networks.severity import Yardstick, as_other_filter, port_directions

Drafts = tuple[Callable[[Rng, Scene], Draft | None], ...]
DRAFTS: Mapping[str, Drafts] = {
    "coulomb_friction": (at_joints.coulomb_friction,),
    "stribeck_friction": (at_joints.stribeck_friction,),
    "hysteresis": (at_joints.hysteresis,),
    "hardening_stiffness": (at_joints.hardening_stiffness,),
    "softening_stiffness": (at_joints.softening_stiffness,),
    "one_sided_stop": (at_joints.one_sided_stop,),
    "backlash": (at_joints.backlash,),
    "varying_stiffness": (at_joints.varying_stiffness,),
    "geometric": (at_joints.geometric,),
    "quadratic_damping": (at_joints.quadratic_damping,),
    "extra_mode": (at_bodies.extra_mode,),
    "added_mass": (at_bodies.added_mass,),
    "missing_link": (at_bodies.missing_link,),
    "gyroscopic": (at_bodies.gyroscopic,),
    "delay": (at_inputs.delay,),
    "lag": (at_inputs.lag,),
    "saturation": (at_inputs.saturation,),
    "dead_zone": (at_inputs.dead_zone,),
    "rate_limit": (at_inputs.rate_limit,),
    "ripple": (at_joints.ripple, at_inputs.input_ripple),
    "harmonics": (at_inputs.harmonics,),
    "gain_error": (at_outputs.gain_error, at_inputs.input_gain_error),
    "cross_axis": (at_outputs.cross_axis,),
    "mounting_resonance": (at_outputs.mounting_resonance,),
    "ac_coupling": (at_outputs.ac_coupling,),
    "time_offset": (at_outputs.time_offset,),
    "clipping": (at_outputs.clipping,),
    "quantization": (at_outputs.quantization,),
    "anti_alias": (at_outputs.anti_alias, at_inputs.input_anti_alias),
    "clock_drift": (at_outputs.clock_drift,),
    "swapped_channels": (at_outputs.swapped_channels,),
    "offset": (at_outputs.offset,),
    "base_vibration": (at_bodies.base_vibration,),
    "tonal_disturbance": (at_bodies.tonal_disturbance, at_outputs.output_tone),
    "unbalance": (at_bodies.unbalance,),
}
OUTSIDE_DRAFTS: Mapping[str, Drafts] = {
    "viscoelastic": (outside.viscoelastic,),
    "position_dependent_damping": (outside.position_dependent_damping,),
    "periodic_stiffness": (outside.periodic_stiffness,),
    "fluid_coupling": (outside.fluid_coupling,),
    "square_sensor": (outside.square_sensor,),
    "held_samples": (outside.held_samples,),
    "drifting_gain": (outside.drifting_gain,),
    "rectified_crosstalk": (outside.rectified_crosstalk,),
}
CLEAR = 3.0
"""What a change and what is left of it are over the noise where a case is clear."""
LEAST, MOST = 5.0, 300.0
"""Between what a clear effect changes over the noise."""


class RefusedError(Exception):
    """A draw that makes no fair case, with the reason."""


class NotClearError(RefusedError):
    """An effect that could be another, or that tuning takes up; a larger one may not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """An effect of settled size.

    Attributes
    ----------
    draft, made
        What was drawn, and what it adds at its size.
    ratio, ratio_tuned
        Change of the log by it alone over the noise, and what tuning leaves of that, None where not asked for.
    nearest
        The other place or word that comes nearest, and what it leaves over the noise.
    """

    draft: Draft
    made: Made
    ratio: float
    ratio_tuned: float | None = None
    nearest: tuple[str, float] | None = None


def logged(scene: Scene, additions: tuple[Addition, ...], *, filtered: bool) -> Matrix:
    """Outputs as a log holds them, with their noise, behind the filter of all channels or not."""
    outputs = scene.recorded(additions, filtered=filtered).outputs
    return converted(scene.network, additions, outputs + scene.noise)


def yardstick(scene: Scene, outputs: Matrix) -> Yardstick:
    """Measure of changes, by what the log's outputs and noise are."""
    numbers = scene.nominal.numbers()
    return Yardstick(
        view=scene.view, steps={name: numbers[name] * sigma for name, sigma in scene.tolerances.items()},
        outputs=np.sqrt(np.mean(outputs**2, axis=1)), noise=scene.noise_levels * scene.outputs_rms,
    )  # fmt: skip


def draw_draft(rng: Rng, scene: Scene, word: str, taken: Sequence[str] = ()) -> Draft:
    """Draw a place and form for a word, away from `taken` sites."""
    drafts = DRAFTS[word] if word in DRAFTS else OUTSIDE_DRAFTS[word]
    draft: Draft | None = drafts[rng.integers(len(drafts))](rng, scene)
    if draft is None:
        raise RefusedError(f"{word}: no site")
    ends = set(draft.site.split("~"))
    if any(ends & set(site.split("~")) for site in taken):
        raise RefusedError(f"{word}: site taken")
    return draft


def settle(
    scene: Scene, draft: Draft, among: tuple[Addition, ...], wanted: float, least: float, most: float
) -> Hidden:
    """Seek the size at which a draft, after other additions, changes the log by `wanted` times the noise."""
    size, smallest, largest = draft.sizes
    before = logged(scene, among, filtered=False)
    for _ in range(5):
        made = draft.build(size)
        after = logged(scene, (*among, made.addition), filtered=False)
        if not np.all(np.isfinite(after)):
            raise RefusedError(f"{draft.word}: unstable")
        ratio = yardstick(scene, after).ratio(after - before)
        if draft.fixed or (least <= ratio <= most and 0.4 < ratio / wanted < 2.5):
            break
        size = float(np.clip(size * np.clip(wanted / max(ratio, 1e-9), 0.02, 20), smallest, largest))
    if ratio < least or (ratio > most and not draft.fixed):
        raise RefusedError(f"{draft.word}: too {'little' if ratio < least else 'much'}")
    acting = scene.recorded((*among, made.addition)).acting[-1]
    if not draft.acting[0] <= acting <= draft.acting[1]:
        raise RefusedError(f"{draft.word}: acts too {'seldom' if acting < draft.acting[0] else 'long'}")
    return Hidden(draft=draft, made=made, ratio=ratio)


def hide(scene: Scene, draft: Draft, wanted: float) -> Hidden:
    """Settle a draft alone in a scene, larger when at first it isn't clear."""
    hidden = settle(scene, draft, (), wanted, LEAST, MOST)
    try:
        return clear(scene, hidden, (hidden.made.addition,), ())
    except NotClearError:
        hidden = settle(scene, draft, (), min(5 * hidden.ratio, 0.8 * MOST), 1.5 * hidden.ratio, MOST)
        return clear(scene, hidden, (hidden.made.addition,), ())


def clear(scene: Scene, hidden: Hidden, every: tuple[Addition, ...], rest: tuple[Addition, ...]) -> Hidden:
    """Check that an effect is no other in disguise, and that tuning leaves of it what the noise doesn't cover.

    `every` and `rest`: all that is added, with and without it.
    """
    hidden = distinct(scene, hidden, every, rest)
    change, measure = _change(scene, every, rest)
    # What is a wrong number by another name is told by tolerances alone.
    tuned = measure.ratio(measure.tuned(change, 3.0 if hidden.draft.is_number else np.inf).left)
    if tuned < CLEAR:
        raise NotClearError(f"{hidden.draft.word}: tuned away")
    return replace(hidden, ratio_tuned=tuned)


def distinct(scene: Scene, hidden: Hidden, every: tuple[Addition, ...], rest: tuple[Addition, ...]) -> Hidden:
    """Check that no force at another place, no filter of another word and no gain does the same; see `clear`."""
    draft = hidden.draft
    change, measure = _change(scene, every, rest)
    hidden = replace(hidden, ratio=measure.ratio(change))
    nearest = [
        *_elsewhere(measure, draft, change), *_other_filter(scene, hidden), *_as_gain(scene, measure, draft, change)
    ]  # fmt: skip
    for name, left in nearest:
        if left < CLEAR:
            raise NotClearError(f"{draft.word}: like {_kind_of(scene, name)}")
    return replace(hidden, nearest=min(nearest, key=lambda entry: entry[1]) if nearest else None)


def _change(scene: Scene, every: tuple[Addition, ...], rest: tuple[Addition, ...]) -> tuple[Matrix, Yardstick]:
    after = logged(scene, every, filtered=False)
    return after - logged(scene, rest, filtered=False), yardstick(scene, after)


def _kind_of(scene: Scene, name: str) -> str:
    return "another place" if name in port_directions(scene.view) else name


def _elsewhere(measure: Yardstick, draft: Draft, change: Matrix) -> list[tuple[str, float]]:
    """The other joints (or bodies, for what acts at one) where any force could do the same, and what they leave."""
    if draft.direction is None:
        return []
    network = measure.view.network
    bodies = draft.site in network.bodies
    others = {
        name: direction
        for name, direction in port_directions(measure.view).items()
        if (name in network.bodies) == bodies and name != draft.site and not _parallel(direction, draft.direction)
    }
    own, *left = measure.elsewhere(change, [draft.direction, *others.values()])
    # What is left at the right place is the window's, and stands in what is left at the others too.
    return [(name, float(np.sqrt(max(one**2 - own**2, 0.0)))) for name, one in zip(others, left, strict=True)]


def _parallel(one: Matrix, other: Matrix) -> bool:
    return np.array_equal(one, other) or np.array_equal(one, -other)


def _other_filter(scene: Scene, hidden: Hidden) -> list[tuple[str, float]]:
    if hidden.made.response is None:
        return []
    share, word = as_other_filter(scene, hidden.draft.word, hidden.draft.site, hidden.made.response)
    return [(word, share * hidden.ratio)]


def _as_gain(scene: Scene, measure: Yardstick, draft: Draft, change: Matrix) -> list[tuple[str, float]]:
    """What a wrong gain of the same signal leaves of a change: all, if a sine saturates at one level."""
    drives = [drive.name for drive in scene.network.drives]
    sensors = [sensor.name for sensor in scene.network.sensors]
    if draft.word == "gain_error" or draft.site not in (*drives, *sensors):
        return []
    if draft.site in drives:
        alone = tuple(
            replace(drive, values=drive.values * float(name == draft.site))
            for name, drive in zip(drives, scene.drives, strict=True)
        )
        by_gain = replace(scene.view, drives=alone).log()
    else:
        by_gain = scene.recorded().outputs * (np.array(sensors) == draft.site)[:, np.newaxis]
    weighted, by_gain = change * measure.weights, by_gain * measure.weights
    gain = np.sum(weighted * by_gain) / np.sum(by_gain**2)
    return [("gain_error", float(np.sqrt(np.mean((weighted - gain * by_gain) ** 2))))]
