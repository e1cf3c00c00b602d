r"""Names as they are shown, whoever chose them: no character in them is obeyed, hides another or reorders the rest.

A log comes from a stranger's machine. Its topics, keys, joints, schemas, units and remarks, and the names of files,
may hold what a terminal obeys (escape sequences), what forges a line (line feeds) and what nobody sees (marks of
direction, characters without width). They are shown as Python writes them in a string: ``\x1b``, ``\n``, ``\u202e``.
"""

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

# Letters, marks and signs that Python can print, but that are drawn as nothing: Unicode's
# Default_Ignorable_Code_Point (DerivedCoreProperties.txt) without the two selectors that tell an emoji's looks.
_UNSEEN = frozenset(
    map(chr, (0x34F, 0x115F, 0x1160, 0x17B4, 0x17B5, *range(0x180B, 0x1810), 0x3164, *range(0xFE00, 0xFE0E), 0xFFA0,
              *range(0xE0100, 0xE01F0)))
)  # fmt: skip
_SHORT = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}
# What begins a formula in a spreadsheet: a name comes from a log, which nobody vouches for.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_MAY_BE_ODD = re.compile(r"[^ -~]")
_HEX = "[0-9a-fA-F]"
# The last backslash of an odd row begins an escape; those of an even row stand for half as many in a quoted name.
_ESCAPED = re.compile(
    rf"(?<!\\)((?:\\\\)*)\\(?:([nrt])|x({_HEX}{{2}})|u({_HEX}{{4}})|U(00(?:0{_HEX}|10){_HEX}{{4}}))"
)


def visible(text: str) -> str:
    r"""Show every character of a text: what would be obeyed, reorder or hide is written as an escape.

    What a terminal merely draws stays: Greek, umlauts, Chinese, emoji. What is visible already stays as it is, so it
    does no harm to ask twice. A backslash stays too: two names of one file that would look alike are told apart where
    the names are made.

    Examples
    --------
    >>> visible("/arm\x1b[2J.\u202ex")
    '/arm\\x1b[2J.\\u202ex'
    >>> visible("Größe ω 速度 🤖")
    'Größe ω 速度 🤖'
    """
    return _MAY_BE_ODD.sub(lambda found: _shown(found[0]), text)


def visible_lines(text: str) -> str:
    r"""Show every character of a text of ours that has several lines, such as a traceback; its lines end as they do.

    Examples
    --------
    >>> visible_lines("a\x1b\nb")
    'a\\x1b\nb'
    """
    return "\n".join(map(visible, text.split("\n")))


def visible_json(document: str) -> str:
    r"""Write what `visible` shows of a JSON document as JSON does: the same document, harmless on a terminal.

    Its lines end as they do; other odd characters are in its strings alone.

    Examples
    --------
    >>> visible_json('{"a": "\u202eω"}')
    '{"a": "\\u202eω"}'
    """
    return _MAY_BE_ODD.sub(lambda found: found[0] if found[0] == "\n" else _in_json(found[0]), document)


def document_text(content: Mapping[str, Any]) -> str:
    r"""Write a document as ``--json`` gives it.

    Examples
    --------
    >>> document_text({"format": "chladni.info/1"})
    '{\n "format": "chladni.info/1"\n}\n'
    """
    return visible_json(json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)) + "\n"


def as_meant(text: str) -> str:
    r"""Read a name that was copied from where it's shown: the inverse of `visible`.

    A backslash of the name itself is doubled, as in quoted parts of a message path; it is left as it stands.

    Examples
    --------
    >>> as_meant(r"/arm\x1b[2J.x") == "/arm\x1b[2J.x", as_meant(r'/a."b\\x1b"')
    (True, '/a."b\\\\x1b"')
    """
    return _ESCAPED.sub(lambda found: found[1] + _meant(*found.groups()[1:]), text)


def cell_text(text: str) -> str:
    r"""Write a text into a cell of a table that a spreadsheet may open: on one line, and no formula.

    What begins as a formula, or holds what isn't seen, gets an apostrophe before it, which marks text in
    spreadsheets; what isn't seen is written as an escape then, and backslashes are doubled. `cell_meant` reads it.

    Examples
    --------
    >>> print(cell_text("tip"), cell_text("=cmd()"), cell_text("a\nb"))
    tip '=cmd() 'a\nb
    """
    if visible(text) == text and not text.startswith(_FORMULA) and cell_meant(text) == text:
        return text
    return "'" + visible(text.replace("\\", "\\\\"))


def cell_meant(cell: str) -> str:
    """Give the text that `cell_text` wrote; any other cell is left as it is."""
    if not cell.startswith("'") or not (cell[1:].startswith((*_FORMULA, "'")) or _ESCAPED.search(cell)):
        return cell
    return as_meant(cell[1:]).replace("\\\\", "\\")


def place_of(name: str, known: Sequence[str]) -> int | None:
    """Give the place of the first name that is `name`, or else is shown as `name` is; None where there's none."""
    if name in known:
        return known.index(name)
    told = visible(name)
    return next((place for place, one in enumerate(known) if visible(one) == told), None)


def _shown(character: str) -> str:
    if _is_seen(character):
        return character
    code = ord(character)
    form = r"\x{:02x}" if code < 0x100 else r"\u{:04x}" if code < 0x10000 else r"\U{:08x}"
    return _SHORT.get(character) or form.format(code)


def _in_json(character: str) -> str:
    if _is_seen(character):
        return character
    units = character.encode("utf-16-be", errors="surrogatepass")
    return "".join(rf"\u{units[place : place + 2].hex()}" for place in range(0, len(units), 2))


def _is_seen(character: str) -> bool:
    return character.isprintable() and character not in _UNSEEN


def _meant(letter: str | None, *codes: str | None) -> str:
    if letter is not None:
        return {"n": "\n", "r": "\r", "t": "\t"}[letter]
    return chr(int(next(code for code in codes if code is not None), 16))
