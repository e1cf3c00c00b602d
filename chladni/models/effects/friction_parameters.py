"""Numbers that the friction laws share: how a sign function is made smooth, and how far bristles bend."""

from chladni.models.core.parameter import Parameter

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
