"""Controllers that close a loop around an input of a structure."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Final, Literal

from chladni.models.core.port import HoldKind
from chladni.signals.errors import ModelError
from chladni.signals.units import quotient, si_factor

Law = Literal["p", "pd", "pi", "pid", "p-p", "transfer-function"]

#: Gains that each law needs; laws with a rate take ``filter`` beside them.
GAINS: Final[Mapping[Law, tuple[str, ...]]] = {
    "p": ("kp",),
    "pd": ("kp", "kd"),
    "pi": ("kp", "ki"),
    "pid": ("kp", "ki", "kd"),
    "p-p": ("kp", "kv"),
    "transfer-function": (),
}
FILTER: Final = "filter"
LAWS_WITH_RATE: Final = ("pd", "pid", "p-p")


def gains_of(law: Law) -> tuple[str, ...]:
    """Names of the gains that a law may have."""
    return (*GAINS[law], FILTER) if law in LAWS_WITH_RATE else GAINS[law]


def controller_units(law: Law, gain_unit: str | None, *, driven_unit: str, feedback_unit: str) -> dict[str, str]:
    """Unit of each number of a controller by its key, and of its command u as ``command``.

    Examples
    --------
    >>> units = controller_units("p-p", "N/V", driven_unit="N", feedback_unit="m")
    >>> units["command"], units["kp"], units["kv"]
    ('V', '1/s', 'V/(m/s)')
    """
    command = driven_unit if gain_unit is None else quotient(driven_unit, gain_unit)
    per_error = quotient(command, feedback_unit)
    per_rate = quotient(command, quotient(feedback_unit, "s"))
    return {
        "command": command,
        "kp": "1/s" if law == "p-p" else per_error,
        "ki": quotient(per_error, "s"),
        "kd": per_rate,
        "kv": per_rate,
        FILTER: "s",
        "gain": gain_unit or "1",
        "limit": command,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Controller:
    """A law that commands an input from a reference and an output that is fed back.

    With the error e = reference - feedback::

        p                  u = kp e
        pd                 u = kp e - kd rate(feedback)
        pi                 u = kp e + ki integral(e)
        pid                u = kp e + ki integral(e) - kd rate(feedback)
        p-p                u = kv (kp e - rate(feedback))          position over velocity
        transfer-function  u = num(s)/den(s) e

    and the driven input is ``gain u``, limited. Without ``filter`` the rate is the exact derivative; with it
    ``s/(filter s + 1)``.

    Attributes
    ----------
    name
        Name in the model; also of the input that the reference becomes.
    feedback
        An output.
    drives
        An input of kind ``force``.
    law
        See above.
    gains
        By name, as `GAINS` says; ``filter`` in s.
    num, den
        Coefficients of the transfer function, highest power of s first.
    reference
        Channel of a log that holds the reference, or None. Either way it's an input, named like the controller.
    hold
        How the reference runs between its samples, see `Terminal`.
    rate_of
        ``feedback``: a step of the reference gives no impulse; ``error``: the textbook's PD, with the rate of the
        error.
    gain
        Force for a unit of u.
    gain_unit
        SI unit such as ``N/V``; None when u is taken in the driven input's own unit.
    limit
        Largest magnitude that the command has; None for none.
    limit_unit
        None when `limit` is in u's unit. Else the driven input's unit: the force is limited.

    Raises
    ------
    ModelError
        When gains are missing, unknown or not finite, the transfer function is improper, or the limit isn't positive.
    """

    name: str
    feedback: str
    drives: str
    law: Law = "p"
    gains: Mapping[str, float] = field(default_factory=dict)
    num: tuple[float, ...] = ()
    den: tuple[float, ...] = ()
    reference: str | None = None
    hold: HoldKind | None = None
    rate_of: Literal["feedback", "error"] = "feedback"
    gain: float = 1.0
    gain_unit: str | None = None
    limit: float | None = None
    limit_unit: str | None = None

    def __post_init__(self) -> None:
        for mistake in (*self._gain_mistakes(), *self._transfer_mistakes(), *self._drive_mistakes()):
            raise ModelError(f"controller {self.name!r}: {mistake}")

    def force_limit(self) -> float | None:
        """Largest magnitude of the driven input, in its unit; None for none."""
        if self.limit is None:
            return None
        return self.limit if self.limit_unit is not None else self.limit * abs(self.gain)

    def units(self, *, driven_unit: str, feedback_unit: str) -> dict[str, str]:
        """Unit of each number that the controller may have, by its key, and of u as ``command``."""
        units = controller_units(self.law, self.gain_unit, driven_unit=driven_unit, feedback_unit=feedback_unit)
        return units | {"limit": self.limit_unit or units["command"]}

    def _gain_mistakes(self) -> list[str]:
        needed, allowed = GAINS[self.law], gains_of(self.law)
        wish = f"law {self.law} has gains {', '.join(allowed)}" if allowed else f"law {self.law} has no gains"
        found = [f"gain {name} is missing; {wish}" for name in needed if name not in self.gains]
        found += [f"gain {name} is unknown; {wish}" for name in self.gains if name not in allowed]
        found += [
            f"gain {name} = {value} must be finite" for name, value in self.gains.items() if not isfinite(value)
        ]
        if self.gains.get(FILTER, 1.0) <= 0:
            found.append(f"gain filter = {self.gains[FILTER]} s must be positive; leave it out for the exact rate")
        return found

    def _transfer_mistakes(self) -> list[str]:
        if self.law != "transfer-function":
            return [f"law {self.law} has no num and den"] if self.num or self.den else []
        if not self.num or not self.den:
            return ["needs num and den, coefficients with the highest power of s first"]
        if not all(map(isfinite, (*self.num, *self.den))) or self.den[0] == 0 or self.num[0] == 0:
            return ["num and den must be finite and begin with a coefficient that isn't zero"]
        if len(self.num) > len(self.den):
            degrees = f"num has degree {len(self.num) - 1}, more than den with {len(self.den) - 1}"
            return [f"{degrees}: no real controller differentiates so; give den more lag"]
        return []

    def _drive_mistakes(self) -> list[str]:
        found = []
        # A scaled unit would change the number when it's written and read back.
        if self.gain_unit is not None and si_factor(self.gain_unit)[0] != 1:
            found.append(f"gain_unit {self.gain_unit!r} is no SI unit; give the gain in SI")
        if self.rate_of == "error" and self.law not in ("pd", "pid"):
            found.append(f"rate_of is for the laws pd and pid, not for {self.law}")
        if not isfinite(self.gain) or self.gain == 0:
            found.append(f"gain {self.gain} must be finite and not zero")
        if self.limit is not None and not (isfinite(self.limit) and self.limit > 0):
            found.append(f"limit {self.limit} must be finite and positive")
        return found
