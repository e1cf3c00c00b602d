"""The words of the hidden laws, and the numbers that the compiled loop knows them by."""

#: In the order of `chladni.gap.blind.laws.any_law`; ``delay`` is the loop's own.
LAWS = (
    "lugre", "dahl", "quadratic", "bouc_wen", "masing", "contact", "soft_play", "cubic_quintic", "rubber",
    "arctangent", "sine_spring", "smooth_change", "ramp_change", "periodic_change", "ripple", "hard_limit",
    "soft_limit", "hyperbolic_limit", "overlap", "slew", "position_gain", "delay",
)  # fmt: skip
LAW_NUMBERS = {word: number for number, word in enumerate(LAWS)}
DELAY = LAW_NUMBERS["delay"]
#: Elements of a Masing network.
MASING_ELEMENTS = 6
#: Own states of the laws that have any.
LAW_STATES = {"lugre": 1, "dahl": 1, "bouc_wen": 1, "masing": MASING_ELEMENTS, "slew": 1}
