"""One instrument for each elementary transfer function or correction."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from chladni.models.core.instrument import Instrument
from chladni.models.core.port import Terminal
from chladni.models.elements.catalogue import ELEMENTS
from chladni.models.elements.element import Element, ElementKind
from chladni.models.schemes.block import Block
from chladni.models.schemes.scheme_model import SchemeModel

INPUT = "input"


@dataclass(frozen=True, slots=True, kw_only=True)
class _ElementScheme:
    """Builds the scheme of one element: its block and so its parameters have the kind's name (``pt1.gain``)."""

    kind: str

    def __call__(self, values: Mapping[str, float], options: Mapping[str, str]) -> SchemeModel:
        del options
        return element_scheme(ELEMENTS[self.kind]).with_values(values)


def element_scheme(kind: ElementKind) -> SchemeModel:
    """Give the scheme of one element between an input and an output, at its defaults."""
    return SchemeModel(
        name=kind.name,
        blocks=(Block(name=kind.name, content=Element(kind=kind, parameters=kind.parameters), inputs=(INPUT,)),),
        inputs=(Terminal(name=INPUT, unit=kind.input_unit),),
    )


def _instrument(kind: ElementKind) -> Instrument:
    return Instrument(
        name=f"element-{kind.name}",
        title=f"{kind.title}: {kind.formula}",
        parameters=element_scheme(kind).parameters,
        build=_ElementScheme(kind=kind.name),
        step_input=INPUT,
        step_output=kind.name,
    )


#: By the instrument's name, ``element-pt1``: a page shows the knobs of its own element only.
ELEMENT_INSTRUMENTS: Mapping[str, Instrument] = MappingProxyType(
    {instrument.name: instrument for instrument in map(_instrument, ELEMENTS.values())}
)
