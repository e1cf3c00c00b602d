"""Which damper to use, and at which joint: every joint is tried, the size chosen for each."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.optimise import Optimum, optimise
from chladni.models.analysis.wish import Wish, measured
from chladni.models.core.model import Model
from chladni.models.core.reading import Quantity
from chladni.signals.errors import ModelError

_DAMPING = ".damping"


@dataclass(frozen=True, slots=True, kw_only=True)
class Damper:
    """A kind of damper that can be had in sizes.

    Attributes
    ----------
    name
        ``viscous``, ``MR``.
    low, high
        Viscous coefficient that it can have, N s/m (N m s/rad at a rotary joint). For a magnetorheological damper the
        equivalent coefficients without current and with the largest: the energy that it takes from a cycle over
        pi omega X^2.
    """

    name: str
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0 <= self.low < self.high < float("inf"):
            raise ModelError(f"damper {self.name!r}: {self.low} to {self.high} N s/m must rise from 0 or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedDamper:
    """The best size of one damper at one joint.

    Attributes
    ----------
    joint, damper
        Names.
    coefficient
        Added to the joint's own, N s/m.
    wished
        The quantities wished about, with it.
    met
        Whether every limit is kept.
    optimum
        All about the search.
    """

    joint: str
    damper: str
    coefficient: float
    wished: tuple[Quantity, ...]
    met: bool
    optimum: Optimum


@dataclass(frozen=True, slots=True, kw_only=True)
class DamperPlacement:
    """Every damper at every joint, the best first.

    Attributes
    ----------
    without
        The quantities wished about without a damper.
    tried
        Sorted: those that keep the limits first, then by the aim (or by the size, for limits alone).
    """

    without: tuple[Quantity, ...]
    tried: tuple[PlacedDamper, ...]

    @property
    def best(self) -> PlacedDamper | None:
        """The best that meets the wish; None when none does."""
        return self.tried[0] if self.tried[0].met else None


def place_damper(
    model: Model,
    wish: Wish | Sequence[Wish],
    dampers: Sequence[Damper],
    *,
    joints: Sequence[str] = (),
    from_input: str = "",
    to_output: str = "",
    seed: int = 0,
) -> DamperPlacement:
    """Try each damper at each joint of a structure, and choose the size by the wish.

    Parameters
    ----------
    model
        With a parameter ``JOINT.damping`` for each joint.
    wish
        As of `optimise`; limits alone are met with the smallest damper.
    dampers
        Kinds.
    joints
        Which ones; all when empty.
    from_input, to_output
        Whose behaviour; the first of each when empty.
    seed
        Of the search.

    Raises
    ------
    ModelError
        When the model has no joints with damping, a name is unknown, or there is no damper to try.
    """
    known = [name.removesuffix(_DAMPING) for name in model.parameters if name.endswith(_DAMPING)]
    chosen = list(joints) or known
    for joint in chosen:
        if joint not in known:
            raise ModelError(f"no joint {joint!r} with damping; joints: {', '.join(known) or 'none'}")
    if not chosen or not dampers:
        raise ModelError("nothing to try: give a model with joints and at least one damper")
    wishes = (wish,) if isinstance(wish, Wish) else tuple(wish)
    path = linear_path(model, from_input=from_input, to_outputs=(to_output,) if to_output else ())
    ends = path.source.name, path.outputs[0].name
    tried = [_placed(model, joint, damper, wishes, ends, seed) for joint in chosen for damper in dampers]
    return DamperPlacement(
        without=tuple(measured(path.to(ends[1]), one) for one in wishes),
        tried=tuple(sorted(tried, key=lambda one: _rank(one, wishes))),
    )


def _placed(
    model: Model, joint: str, damper: Damper, wishes: tuple[Wish, ...], ends: tuple[str, str], seed: int
) -> PlacedDamper:
    name = joint + _DAMPING
    own = model.parameters[name].value
    low, high = own + damper.low, own + damper.high
    # The search begins at the smallest size, from which limits alone ask for the least change.
    found = optimise(
        model.with_values({name: low}),
        [name],
        wishes,
        bounds={name: (low, high)},
        from_input=ends[0],
        to_output=ends[1],
        seed=seed,
    )
    return PlacedDamper(
        joint=joint,
        damper=damper.name,
        coefficient=found.values[name] - own,
        wished=found.wished_after,
        met=found.met,
        optimum=found,
    )


def _rank(one: PlacedDamper, wishes: tuple[Wish, ...]) -> tuple[bool, float]:
    for wish, quantity in zip(wishes, one.wished, strict=True):
        if wish.limit is None and quantity.value is not None:
            return not one.met, quantity.value if wish.sense == "least" else -quantity.value
    missed = sum(
        wish.excess(quantity.value)
        for wish, quantity in zip(wishes, one.wished, strict=True)
        if quantity.value is not None
    )
    return not one.met, one.coefficient if one.met else missed
