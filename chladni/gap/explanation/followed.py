"""A screened trial followed to its own parameters: the screen is linear at those of its place."""

from dataclasses import replace

import numpy as np

from chladni.gap.calibration import GAINED, PROFILE_STEPS, SHORTER
from chladni.gap.explanation.screen import HeldSite, Screen, Screened
from chladni.gap.location.profile import Profile
from chladni.signals.arrays import Real

_Followed = tuple[Screened, Profile]


def followed(screen: Screen, start: Screened) -> tuple[Screened, Screen] | None:
    """Follow a trial by Gauss and Newton steps in the parameters; also give the screen where it ends.

    A free force hides what parameters should do: those of its place may lie many widths of a resonance from the right
    ones, where a linearisation promises what no parameters keep. The force along the recovered motion stays what it
    is, its amplitudes are refitted. The misfit is that at the trial's own parameters, not a promised one; None when
    no amplitudes make this effect there.
    """
    starts = [one for one in (_held(screen, start, z) for z in (screen.z, start.z)) if one is not None]
    if not starts:
        return None
    best = min(starts, key=lambda one: one[0].cost)
    there = _at(screen, best)
    for _ in range(PROFILE_STEPS):
        aim = there.weigh(start.trial, start.shape)
        found = None if aim is None else _searched(there, start, best, aim.z - best[0].z)
        if found is None:
            break
        gained, best = best[0].cost - found[0].cost, found
        there = _at(screen, best)
        if gained < GAINED * best[0].cost:
            break
    return best[0], there


def _at(screen: Screen, found: _Followed) -> Screen:
    return Screen(screen.problem, found[1], screen.site, others=screen.others, limit=screen.limit)


def _held(screen: Screen, start: Screened, z: Real) -> _Followed | None:
    """Give a trial with its best amplitudes at held parameters; None when these make no such effect."""
    here = HeldSite(screen.problem, z, screen.site, screen.others)
    force = start.trial.form.build(start.shape)
    amplitudes = here.amplitudes(force)
    values = start.trial.form.values(start.shape, amplitudes)
    if values is None or not np.all(np.isfinite(list(values.values()))):
        return None
    profile = here.with_force(force, amplitudes)
    return replace(start, values=values, misfit=profile.misfit, z=z), profile


def _searched(screen: Screen, start: Screened, best: _Followed, step: Real) -> _Followed | None:
    """First part of a step that makes the cost less."""
    for share in (SHORTER**tried for tried in range(3)):
        found = _held(screen, start, best[0].z + share * step)
        if found is not None and found[0].cost < best[0].cost:
            return found
    return None
