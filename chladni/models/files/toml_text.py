"""Writing TOML: the few forms that model files need, with numbers that read back bit for bit."""

import json
import re
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TypeAlias

from chladni.signals.errors import ModelError

Scalar: TypeAlias = str | float | bool
Entry: TypeAlias = "Scalar | Sequence[Entry] | Mapping[str, Entry]"

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(content: Mapping[str, Entry]) -> str:
    """Write a document.

    Parameters
    ----------
    content
        A mapping becomes a table ``[name]``, a list of mappings tables ``[[name]]``; inside tables both are written
        in one line.

    Raises
    ------
    ModelError
        When a number is not finite.

    Examples
    --------
    >>> print(toml_text({"name": "arm", "body": [{"name": "wrist", "mass": 2.5}], "tolerance": {"a.b": 0.2}}), end="")
    name = "arm"
    <BLANKLINE>
    [[body]]
    name = "wrist"
    mass = 2.5
    <BLANKLINE>
    [tolerance]
    "a.b" = 0.2
    """
    # Plain keys first: behind a table's header they would belong to the table.
    head, blocks = [], []
    for key, entry in content.items():
        if isinstance(entry, Mapping):
            blocks.append(_table(f"[{_key(key)}]", entry))
        elif isinstance(entry, list) and all(isinstance(one, Mapping) for one in entry):
            blocks.extend(_table(f"[[{_key(key)}]]", one) for one in entry)
        else:
            head.append(f"{_key(key)} = {_value(entry)}\n")
    return "\n".join(["".join(head), *blocks])


def _table(header: str, table: Mapping[str, Entry]) -> str:
    return "".join([f"{header}\n", *(f"{_key(key)} = {_value(entry)}\n" for key, entry in table.items())])


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _value(entry: Entry) -> str:
    if isinstance(entry, str):
        return _text(entry)
    if isinstance(entry, bool):
        return "true" if entry else "false"
    if isinstance(entry, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(one)}" for key, one in entry.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(entry, Sequence):
        return f"[{', '.join(map(_value, entry))}]"
    if not isfinite(entry):
        raise ModelError(f"{entry} can't be written to a model file; numbers there are finite")
    # The shortest text that reads back as the same number.
    return repr(float(entry))


def _text(text: str) -> str:
    # JSON's strings are TOML's, but for DEL, which TOML wants escaped.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
