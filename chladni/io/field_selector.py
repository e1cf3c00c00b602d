"""Where in a message the number stands that a path names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from chladni.io.decoding.schema import FieldInfo
from chladni.io.message_path import (
    FieldStep,
    FilterStep,
    FilterValue,
    IndexStep,
    KeyStep,
    MessagePath,
    Operator,
    quoted,
)
from chladni.signals.errors import LogError
from chladni.signals.wording import near_matches

NAME_FIELDS = ("name", "names", "joint_names", "channel_names")
"""Fields whose strings name the elements of the arrays beside them (sensor_msgs/JointState and its kin)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldFilter:
    """One comparison on a leaf of the message."""

    leaf: str
    operator: Operator
    value: FilterValue


ElementChoice = int | tuple[FieldFilter, ...]
"""Which element of a list is meant: the one at an index, or the one that passes all filters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldSelector:
    """Where in a message a number stands.

    Attributes
    ----------
    leaf
        Leaf of the schema.
    elements
        Which element is meant of each list that the leaf is in, the outermost first.
    names_leaf
        Strings that name the elements of the innermost list, to be checked when an index is used; None when the
        message has none.
    called
        What they call the element at that index; None where they call it nothing.
    message_filters
        Messages that fail one of them don't belong to the channel.
    publisher
        Which of several publishers, told apart by their stamps, from 1; None for all messages.
    """

    leaf: FieldInfo
    elements: tuple[ElementChoice, ...] = ()
    names_leaf: str | None = None
    called: str | None = None
    message_filters: tuple[FieldFilter, ...] = ()
    publisher: int | None = None

    @property
    def indices(self) -> tuple[int, ...] | None:
        """Index in each list; None where filters choose an element."""
        found = tuple(one for one in self.elements if isinstance(one, int))
        return found if len(found) == len(self.elements) else None

    @property
    def element_filters(self) -> tuple[FieldFilter, ...]:
        """All filters that choose elements."""
        return tuple(one for choice in self.elements if not isinstance(choice, int) for one in choice)

    @property
    def leaves(self) -> tuple[str, ...]:
        """Every leaf that must be decoded."""
        names = () if self.names_leaf is None else (self.names_leaf,)
        filters = self.message_filters + self.element_filters
        return tuple(dict.fromkeys((self.leaf.path, *names, *(one.leaf for one in filters))))


# --- from path to selector ---------------------------------------------------------------------------------------


def resolve_fields(path: MessagePath, fields: Sequence[FieldInfo]) -> FieldSelector:
    """Find the leaf that a path names.

    Parameters
    ----------
    path
        A path whose topic is known.
    fields
        Leaves of that topic's messages.

    Raises
    ------
    LogError
        When there's no such field (near ones are named), when it's text, or when an index is missing or too much.
    """
    walk = _Walk(path, fields)
    for step in path.steps:
        walk.take(step)
    return walk.selector()


class _Walk:
    """State of the walk down one path."""

    def __init__(self, path: MessagePath, fields: Sequence[FieldInfo]) -> None:
        self._path = path
        self._known = {info.path: info for info in fields}
        self._prefix = ""
        self._elements: list[ElementChoice] = []
        self._at_slice = False
        self._names: str | None = None
        self._message_filters: list[FieldFilter] = []
        self._publisher: int | None = None

    def take(self, step: FieldStep | IndexStep | KeyStep | FilterStep) -> None:
        match step:
            case FieldStep(name=name):
                self._prefix = _joined(self._prefix, quoted(name))
                self._at_slice = False
            case IndexStep(index=index):
                self._enter_array(() if index is None else index)
                self._at_slice = index is None
            case KeyStep(name=name):
                names = self._names_beside()
                self._enter_array((FieldFilter(leaf=names, operator="==", value=name),))
            case FilterStep():
                self._filter(step)

    def selector(self) -> FieldSelector:
        leaf = self._known.get(self._prefix)
        if leaf is None:
            raise self._unknown(self._prefix)
        if leaf.kind == "string":
            raise LogError(f"{self._path.text!r}: {leaf.path} is text, not a number; use it in a filter")
        if () in self._elements:
            raise LogError(f"{self._path.text!r}: a slice gives many numbers; name one by [index] or by a filter")
        if len(self._elements) < len(leaf.dims):
            raise LogError(f"{self._path.text!r}: {leaf.path} is an array; name an element, {self._path.text}[0]")
        return FieldSelector(
            leaf=leaf,
            elements=tuple(self._elements),
            names_leaf=self._names if self._elements and isinstance(self._elements[-1], int) else None,
            message_filters=tuple(self._message_filters),
            publisher=self._publisher,
        )

    def _enter_array(self, choice: ElementChoice) -> None:
        marked = f"{self._prefix}[]"
        if any(path.startswith(marked) for path in self._known):
            self._prefix = marked
        elif self._prefix not in self._known:
            raise self._unknown(self._prefix)
        elif len(self._known[self._prefix].dims) == len(self._elements):
            what = "takes an index for each array it is in" if self._elements else "is a single value, not an array"
            raise LogError(f"{self._path.text!r}: {self._prefix} {what}; leave out the index")
        else:
            self._names = names_beside(self._known[self._prefix], self._known)
        self._elements.append(choice)

    def _names_beside(self) -> str:
        leaf = self._known.get(self._prefix)
        names = None if leaf is None else names_beside(leaf, self._known)
        if names is None:
            raise LogError(
                f"{self._path.text!r}: no field {' or '.join(NAME_FIELDS)} beside {self._prefix} names its elements; "
                "give a number as index"
            )
        return names

    def _filter(self, step: FilterStep) -> None:
        if step.field.startswith("@"):
            self._publisher = self._number_of_publisher(step)
            return
        leaf = _joined(self._prefix, step.field)
        if leaf not in self._known:
            raise self._unknown(leaf)
        is_text = self._known[leaf].kind == "string"
        if is_text != isinstance(step.value, str) or (is_text and step.operator not in ("==", "!=")):
            kind = "text: compare it by == or != with a quoted value" if is_text else "a number: leave out the quotes"
            raise LogError(f"{self._path.text!r}: {leaf} in the filter is {kind}")
        comparison = FieldFilter(leaf=leaf, operator=step.operator, value=step.value)
        chosen = self._elements[-1] if self._at_slice else None
        if self._elements and not isinstance(chosen, tuple):
            raise LogError(f"{self._path.text!r}: a filter follows [:], not an element that is already chosen")
        if len(self._known[leaf].dims) > len(self._elements):
            raise LogError(
                f"{self._path.text!r}: {leaf} is an array; a filter on elements is written array[:]{{...}}"
            )
        if isinstance(chosen, tuple):
            self._elements[-1] = (*chosen, comparison)
        else:
            self._message_filters.append(comparison)

    def _number_of_publisher(self, step: FilterStep) -> int:
        """What isn't in the message: who sent it."""
        number = step.value if isinstance(step.value, float) else 0.0
        known = step.field == "@publisher" and step.operator == "==" and not self._prefix
        if known and number >= 1 and number.is_integer():
            return int(number)
        topic = self._path.topic
        raise LogError(
            f"{self._path.text!r}: {step.field} is no field of a message; right behind the topic, "
            f"{topic}{{@channel==1}} is one MCAP channel, by its number in the log, of a topic that has several, and "
            f"{topic}{{@publisher==1}} the first publisher of those that their stamps tell apart"
        )

    def _unknown(self, leaf: str) -> LogError:
        for known in self._known:
            if known.replace("[]", "") == leaf.replace("[]", ""):
                example = known.replace("[]", "[0]")
                return LogError(f"{self._path.text!r}: {known} takes an index for each [], as {example}")
        near = near_matches(leaf, self._known)
        return LogError(f"{self._path.text!r}: messages of {self._path.topic} have no field {leaf!r}; {near}")


def names_beside(leaf: FieldInfo, known: Mapping[str, FieldInfo]) -> str | None:
    """Leaf with the strings that name the elements of an array, or None."""
    parent = leaf.path.rpartition(".")[0]
    for name in NAME_FIELDS:
        info = known.get(_joined(parent, name))
        if info is not None and info.kind == "string" and info.dims and len(info.dims) == len(leaf.dims):
            return info.path
    return None


def _joined(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix else name
