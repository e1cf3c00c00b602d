"""All words of the vocabulary of unmodelled effects."""

from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType

from chladni.models.effects.ac_coupling import AC_COUPLING
from chladni.models.effects.added_mass import ADDED_MASS
from chladni.models.effects.anti_alias import ANTI_ALIAS
from chladni.models.effects.backlash import BACKLASH
from chladni.models.effects.base_vibration import BASE_VIBRATION
from chladni.models.effects.clipping import CLIPPING
from chladni.models.effects.clock_drift import CLOCK_DRIFT
from chladni.models.effects.coulomb_friction import COULOMB_FRICTION
from chladni.models.effects.cross_axis import CROSS_AXIS
from chladni.models.effects.dead_zone import DEAD_ZONE
from chladni.models.effects.delay import DELAY
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.extra_mode import EXTRA_MODE
from chladni.models.effects.gain_error import GAIN_ERROR
from chladni.models.effects.geometric import GEOMETRIC
from chladni.models.effects.gyroscopic import GYROSCOPIC
from chladni.models.effects.hardening_stiffness import HARDENING_STIFFNESS
from chladni.models.effects.harmonics import HARMONICS
from chladni.models.effects.hysteresis import HYSTERESIS
from chladni.models.effects.lag import LAG
from chladni.models.effects.missing_link import MISSING_LINK
from chladni.models.effects.mounting_resonance import MOUNTING_RESONANCE
from chladni.models.effects.offset import OFFSET
from chladni.models.effects.one_sided_stop import ONE_SIDED_STOP
from chladni.models.effects.quadratic_damping import QUADRATIC_DAMPING
from chladni.models.effects.quantization import QUANTIZATION
from chladni.models.effects.rate_limit import RATE_LIMIT
from chladni.models.effects.ripple import RIPPLE
from chladni.models.effects.saturation import SATURATION
from chladni.models.effects.softening_stiffness import SOFTENING_STIFFNESS
from chladni.models.effects.stribeck_friction import STRIBECK_FRICTION
from chladni.models.effects.swapped_channels import SWAPPED_CHANNELS
from chladni.models.effects.time_offset import TIME_OFFSET
from chladni.models.effects.tonal_disturbance import TONAL_DISTURBANCE
from chladni.models.effects.unbalance import UNBALANCE
from chladni.models.effects.varying_stiffness import VARYING_STIFFNESS

_KINDS = (
    COULOMB_FRICTION,
    STRIBECK_FRICTION,
    QUADRATIC_DAMPING,
    HARDENING_STIFFNESS,
    SOFTENING_STIFFNESS,
    BACKLASH,
    ONE_SIDED_STOP,
    HYSTERESIS,
    EXTRA_MODE,
    ADDED_MASS,
    VARYING_STIFFNESS,
    DELAY,
    LAG,
    SATURATION,
    DEAD_ZONE,
    RATE_LIMIT,
    RIPPLE,
    GAIN_ERROR,
    CROSS_AXIS,
    MOUNTING_RESONANCE,
    AC_COUPLING,
    TIME_OFFSET,
    CLIPPING,
    QUANTIZATION,
    BASE_VIBRATION,
    TONAL_DISTURBANCE,
    MISSING_LINK,
    GYROSCOPIC,
    GEOMETRIC,
    ANTI_ALIAS,
    CLOCK_DRIFT,
    SWAPPED_CHANNELS,
    OFFSET,
    HARMONICS,
    UNBALANCE,
)

#: Every effect by its word.
CATALOGUE: Mapping[str, EffectKind] = MappingProxyType({kind.name: kind for kind in _KINDS})

#: Words that are near misses of each other, by family.
FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        family: tuple(kind.name for kind in _KINDS if kind.family == family)
        for family in dict.fromkeys(kind.family for kind in _KINDS)
    }
)


def spoken_effect(effect: str) -> str:
    """Give an effect's word as one says it; words of somebody's own effects lose their underscores.

    Examples
    --------
    >>> spoken_effect("coulomb_friction"), spoken_effect("extra_mode"), spoken_effect("magnetic_brake")
    ('Coulomb friction', 'an extra mode', 'magnetic brake')
    """
    return CATALOGUE[effect].spoken if effect in CATALOGUE else effect.replace("_", " ")


def taking_part(leave_out: Collection[str], own: Iterable[EffectKind]) -> tuple[EffectKind, ...]:
    """Give all words and effects of one's own, which stand in place of a word of their name, but for some."""
    every = {**CATALOGUE, **{kind.name: kind for kind in own}}
    return tuple(kind for name, kind in every.items() if name not in leave_out)
