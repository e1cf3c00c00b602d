"""All kinds of elements by the word that files use."""

from collections.abc import Mapping
from types import MappingProxyType

from chladni.models.elements.basic import BASIC
from chladni.models.elements.corrections import CORRECTIONS
from chladni.models.elements.electrical import ELECTRICAL
from chladni.models.elements.element import Element, ElementKind
from chladni.models.elements.mechanical import MECHANICAL
from chladni.models.elements.pid import REGULATORS
from chladni.signals.errors import ModelError
from chladni.signals.wording import near_words

#: Every kind of element by name, in the order in which people learn them.
ELEMENTS: Mapping[str, ElementKind] = MappingProxyType(
    {kind.name: kind for kind in (*BASIC, *REGULATORS, *CORRECTIONS, *ELECTRICAL, *MECHANICAL)}
)


def element_kind(name: str) -> ElementKind:
    """Give the named kind; `ModelError` that names the nearest one when there's none."""
    if name in ELEMENTS:
        return ELEMENTS[name]
    near = near_words(name, ELEMENTS)
    raise ModelError(
        f"no element {name!r:.60}; " + (f"did you mean {near[0]}?" if near else f"kinds: {', '.join(ELEMENTS)}")
    )


def element(kind: str, **values: float) -> Element:
    """Give an element; what isn't given has its default.

    Raises
    ------
    ModelError
        When the kind or a parameter is unknown, or a value is impossible.

    Examples
    --------
    >>> element("pi", gain=2.97, integral_time=9.9).transfer.static_gain()
    inf
    """
    found = element_kind(kind)
    made = Element(kind=found, parameters=found.parameters)
    # Stated by whoever builds: what they state is usual for their element.
    for name, value in values.items():
        made = made.with_usual_value(name, value)
    return made
