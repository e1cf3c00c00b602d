"""The words of effects and their families, and what lies outside of them.

A copy of the contract, kept apart from the catalogue: a word that the catalogue lost would be lost here too.
"""

from collections.abc import Mapping

FAMILIES: Mapping[str, tuple[str, ...]] = {
    "friction": ("coulomb_friction", "stribeck_friction", "hysteresis"),
    "stiffness": ("hardening_stiffness", "softening_stiffness", "one_sided_stop", "backlash", "varying_stiffness",
                  "geometric"),
    "damping": ("quadratic_damping",),
    "attachment": ("extra_mode", "added_mass"),
    "coupling": ("missing_link", "gyroscopic"),
    "actuator": ("delay", "lag", "saturation", "dead_zone", "rate_limit", "ripple", "harmonics"),
    "sensor": ("gain_error", "cross_axis", "mounting_resonance", "ac_coupling", "time_offset", "clipping",
               "quantization", "anti_alias", "clock_drift", "swapped_channels", "offset"),
    "disturbance": ("base_vibration", "tonal_disturbance", "unbalance"),
}  # fmt: skip
#: Words that only robots have, beside those above.
ROBOT_FAMILIES: Mapping[str, tuple[str, ...]] = {
    "friction": ("viscous_friction", "load_friction"),
    "stiffness": ("joint_elasticity", "joint_spring"),
    "attachment": ("armature", "payload"),
    "actuator": ("controller_gain",),
    "sensor": ("encoder_offset", "misalignment"),
    "disturbance": ("gravity_tilt", "external_force"),
}
FAMILY_OF: Mapping[str, str] = {
    word: family for words_of in (FAMILIES, ROBOT_FAMILIES) for family, words in words_of.items() for word in words
}
WORDS: tuple[str, ...] = tuple(word for words in FAMILIES.values() for word in words)
#: Outside the vocabulary, each with the family whose words are a fair near miss; empty where none is.
OUTSIDE: Mapping[str, str] = {
    "viscoelastic": "",
    "gyroscopic_coupling": "coupling",
    "periodic_stiffness": "stiffness",
    "position_dependent_gain": "actuator",
    "square_sensor": "sensor",
    "held_samples": "sensor",
    "position_dependent_damping": "damping",
    "fluid_coupling": "coupling",
    "drifting_gain": "sensor",
    "rectified_crosstalk": "sensor",
    "push": "",
    "coupled_spring": "",
    "coupled_friction": "friction",
}
