"""Lists of numbers that lie side by side in messages, one element for each joint or motor."""

from dataclasses import dataclass

from chladni.io.message_path import element_text


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberLists:
    """Lists of numbers side by side in each message of a topic, with an element for each joint or motor.

    Attributes
    ----------
    topic
        How paths of it begin.
    schema_name
        Message type.
    place
        Where in a message: empty at its top, else such as ``desired`` or ``points[0]``.
    names
        What the elements are called: every distinct list of the first messages; empty where nothing names them.
    named_in_message
        Whether the names lie beside the lists, so that an element can be read by its name.
    elements
        How many elements each list has in the first messages, by its field.
    """

    topic: str
    schema_name: str
    place: str
    names: tuple[tuple[str, ...], ...]
    named_in_message: bool
    elements: dict[str, int]

    @property
    def label(self) -> str:
        """Topic, and the place in it where it isn't the top of the message or a trajectory's first point."""
        return f"{self.topic}.{self.place}" if self.place and "[" not in self.place else self.topic

    def path(self, field: str, element: int | str) -> str:
        """Path of an element, by its number or its name."""
        prefix = f"{self.topic}.{self.place}" if self.place else self.topic
        return f"{prefix}.{field}{element_text(element) if isinstance(element, str) else f'[{element}]'}"
