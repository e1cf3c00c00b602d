"""The forms in which CDR is written: by its header, and where headers leave it open, as its lengths tell.

The header of a message names an encapsulation (DDS-XTypes 1.3, 7.6.3.1.2, and 1.2 for the numbers from 0x10 on). It
doesn't say from where a writer counts alignment, nor which nested types of XCDR2 stand behind a delimiter where the
definition is silent: each of these makes a form, and the right one takes messages up to their last byte.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Final, Literal

from chladni.io.decoding.layout import Layouts
from chladni.io.decoding.schema import (
    Array,
    Delimited,
    FieldType,
    Member,
    Primitive,
    Record,
    Stamp,
)
from chladni.io.decoding.walk import WireRules
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from chladni.io.decoding.schema import Extensibility

HEADER_BYTES: Final = 4
"""Bytes of the encapsulation header; alignment counts from its end, for most writers."""

Encapsulation = Literal["plain", "plain XCDR2", "delimited XCDR2", "parameter list"]

ENCAPSULATIONS: Final[dict[int, Encapsulation]] = {
    0x00: "plain", 0x02: "parameter list",
    0x06: "plain XCDR2", 0x08: "delimited XCDR2", 0x0A: "parameter list",
    0x10: "plain XCDR2", 0x12: "parameter list", 0x14: "delimited XCDR2",
}  # fmt: skip
"""By the number in the header less its last bit, which is the byte order: 1 for little endian."""

# Writers fill messages up to a multiple of 4 bytes, as RTPS asks for.
_CDR: Final = WireRules(max_alignment=8, terminated=True, spare=3)
_FROM_HEADER: Final = replace(_CDR, origin=HEADER_BYTES)
_XCDR2: Final = replace(_CDR, max_alignment=4)
_ROS1: Final = WireRules(max_alignment=1, terminated=False, spare=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Form:
    """One way in which messages of a definition may lie on the wire.

    Parameters
    ----------
    encapsulation : Encapsulation or None
        What their headers name; None for messages without header (ROS 1).
    root : FieldType
        The definition, with the delimiters of this form.
    rules : WireRules
    layouts : Layouts
        Made for these rules.
    note : str
        What is worth telling of it; empty for the usual forms.
    """

    encapsulation: Encapsulation | None
    root: FieldType
    rules: WireRules
    layouts: Layouts
    note: str = ""


def ros1_form(record: Record) -> Form:
    """Give the one form of ROS 1."""
    return _form(None, record, _ROS1)


class FormsOf:
    """The forms of a definition, each made once."""

    def __init__(self, record: Record) -> None:
        self._record = record
        self._made: dict[Encapsulation, list[Form]] = {}

    def of(self, encapsulation: Encapsulation) -> Iterator[Form]:
        """Give what `forms_of` does."""
        if encapsulation not in self._made:
            self._made[encapsulation] = list(forms_of(self._record, encapsulation))
        return iter(self._made[encapsulation])


def forms_of(record: Record, encapsulation: Encapsulation) -> Iterator[Form]:
    """Give the forms that messages may have behind a header, the usual one first.

    No two of them take the same number of bytes unless they are the same: an alignment that counts from elsewhere
    moves the end of the last 8-byte number by 4 bytes, and a delimiter has 4.

    Raises
    ------
    LogError
        For parameter lists, whose members come in any order.
    """
    if encapsulation == "parameter list" or _holds_mutable(record, set()):
        raise LogError(
            f"{record.name}: messages are parameter lists (of @mutable types), which aren't decoded; record the type "
            "as @final or @appendable"
        )
    if encapsulation == "plain":
        note = "numbers are aligned from the encapsulation header on, as the lengths of the messages show"
        yield _form(encapsulation, record, _CDR)
        yield replace(_form(encapsulation, record, _FROM_HEADER), note=note)
        return
    delimited = encapsulation == "delimited XCDR2"
    # Compilers differ in what a type without annotation is; mostly it is what the outermost type is.
    usual: tuple[Extensibility, ...] = ("appendable", "final") if delimited else ("final", "appendable")
    for enumerated, unmarked in product((False, True), usual):
        root = _Delimiting(unmarked=unmarked, enumerated=enumerated).members_of(record)
        yield _form(encapsulation, Delimited(content=root) if delimited else root, _XCDR2)


def _form(encapsulation: Encapsulation | None, root: FieldType, rules: WireRules) -> Form:
    return Form(encapsulation=encapsulation, root=root, rules=rules, layouts=Layouts(rules.max_alignment))


def _holds_mutable(kind: FieldType, seen: set[Record]) -> bool:
    match kind:
        case Array(element=element):
            return _holds_mutable(element, seen)
        case Record(members=members, extensibility=extensibility) if kind not in seen:
            seen.add(kind)
            return extensibility == "mutable" or any(_holds_mutable(member.type, seen) for member in members)
        case _:
            return False


class _Delimiting:
    """Puts delimiters into a definition as XCDR2 does.

    Parameters
    ----------
    unmarked : {"final", "appendable"}
        What a type is whose extensibility isn't stated.
    enumerated : bool
        Whether lists of enumerated values have a delimiter, as all have that aren't of primitive types.
    """

    def __init__(self, *, unmarked: Extensibility, enumerated: bool) -> None:
        self.unmarked = unmarked
        self.enumerated = enumerated
        # One new record for each old one: a definition may use a type many times.
        self.done: dict[Record, Record] = {}

    def members_of(self, record: Record) -> Record:
        """Give a record whose members have their delimiters."""
        if record not in self.done:
            members = tuple(Member(name=one.name, type=self._type(one.type)) for one in record.members)
            self.done[record] = replace(record, members=members)
        return self.done[record]

    def _type(self, kind: FieldType) -> FieldType:
        match kind:
            case Record(extensibility=extensibility):
                return self._grown(self.members_of(kind), extensibility)
            case Stamp():
                return self._grown(kind, None)
            case Array(element=Primitive(enumerated=enumerated)) if not (enumerated and self.enumerated):
                return kind
            case Array(element=element):
                return Delimited(content=replace(kind, element=self._type(element)))
            case _:
                return kind

    def _grown(self, kind: FieldType, extensibility: Extensibility | None) -> FieldType:
        return Delimited(content=kind) if (extensibility or self.unmarked) == "appendable" else kind
