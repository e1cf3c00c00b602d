"""What the friction laws share: how a sign function is made smooth, and how far bristles bend."""

import numpy as np

from chladni.models.core.parameter import Parameter
from chladni.models.effects.clues import FittedForm

#: tanh reaches 76 % of the friction at this speed and 99.99 % at five times it. Small against the speeds of interest,
#: yet large enough for the integrator to pass the reversal in several steps.
CREEP_SPEED = Parameter(
    name="creep_speed", value=1e-4, unit="m/s", low=1e-6, high=1e-2, minimum=1e-12, maximum=1e3,
    meaning="below it the contact creeps: the width over which sgn(s) is made smooth",
)  # fmt: skip

PRESLIDING = Parameter(
    name="presliding", value=1e-5, unit="m", low=1e-7, high=1e-3, minimum=1e-12, maximum=1e3,
    meaning="how far the contact's bristles bend before it slides: sliding force over contact stiffness",
)  # fmt: skip
#: Of the usual way of a joint: a presliding above makes a hysteresis loop.
_LOOP = 0.3


def slides_from(fitted: FittedForm) -> dict[str, float]:
    """Give how a friction begins to slide."""
    return {name: fitted.values[name] for name in ("presliding", "creep_speed") if name in fitted.values}


def holds_like_a_loop(fitted: FittedForm) -> bool:
    """Whether bristles bend so far that the friction is a hysteresis loop."""
    return fitted.values.get("presliding", 0.0) > _LOOP * float(np.std(fitted.motion()[0]))
