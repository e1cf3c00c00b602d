"""Ways to damage bytes and texts, which all formats share."""

import json
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

Damage = Callable[[bytearray, random.Random], None]

ODD_TEXTS = (
    "", " ", "nan", "inf", "-inf", "1e999", "-1e308", "1e-320", "1_0", "0x10", "1,5", "1.5.5", "--1", "+-2", "²",
    "１２", "٣", "NaN()", "null", "true", "#N/A", "=1+1", "@x", '"', "'", "\x1b[31m", "\x1b]52;c;eA==\x07", "\u202e",
    "\u2028", "\u2029", "\x85", "\x0b", "\x0c", "\x1c", "\x00", "\ufeff", "é", "\U0001f600", "a" * 5000, "9" * 5000,
    "-0", "0" * 400, "18446744073709551616", "-9223372036854775809", "1e15", "2262-04-12T00:00:00", "[g]", "\t", "\r",
)  # fmt: skip
"""What people and programs put where a number or a name is due."""


ODD_VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1.5, 1e308, -1e-320, float("nan"), float("inf"), 2**63, 10**400, [], {}, [[]], "", "1", "nan",
    [1.0, None, "x"], {"a": 1}, "RAW1e999WAR", "RAW-0.0WAR", "RAW" + "9" * 5000 + "WAR", "\ud800", "a.b", [1] * 70,
    "RAW" + "[" * 3000 + "]" * 3000 + "WAR", "\x1b]0;x\x07", "effect", "ground",
)  # fmt: skip
"""What people and programs put where a value of JSON is due; RAW...WAR stands as it is."""


def stretch(content: bytearray, rng: random.Random) -> tuple[int, int]:
    """Give the start and the size of a part."""
    start = rng.randrange(len(content))
    return start, min(rng.choice((1, 4, 9, 60, 700, 5000)), len(content) - start)


def flip(content: bytearray, rng: random.Random) -> None:
    for _ in range(rng.choice((1, 1, 2, 8))):
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)


def overwrite(content: bytearray, rng: random.Random) -> None:
    start, size = stretch(content, rng)
    content[start : start + size] = rng.randbytes(size)


def cut(content: bytearray, rng: random.Random) -> None:
    del content[rng.randrange(len(content)) :]


def drop(content: bytearray, rng: random.Random) -> None:
    start, size = stretch(content, rng)
    del content[start : start + size]


def zero(content: bytearray, rng: random.Random) -> None:
    start, size = stretch(content, rng)
    content[start : start + size] = bytes(size)


def zero_tail(content: bytearray, rng: random.Random) -> None:
    start = rng.randrange(len(content))
    content[start:] = bytes(len(content) - start)


def repeat(content: bytearray, rng: random.Random) -> None:
    start, size = stretch(content, rng)
    content[start:start] = content[start : start + size]


def splice(content: bytearray, rng: random.Random) -> None:
    start, size = stretch(content, rng)
    at = rng.randrange(len(content))
    content[at : at + size] = content[start : start + size]


def append(content: bytearray, rng: random.Random) -> None:
    content += rng.choice((bytes(rng.randrange(1, 5000)), rng.randbytes(rng.randrange(1, 50))))


def huge_number(content: bytearray, rng: random.Random) -> None:
    """Write a size that the file doesn't have, of four or eight bytes in either order."""
    size = rng.choice((4, 8))
    value = rng.choice((1 << 60, (1 << 64) - 1, 1 << 63, 1 << 31, (1 << 31) - 1, len(content), 0, 1, 1 << 20))
    at = rng.randrange(max(1, len(content) - size))
    content[at : at + size] = (value & (256**size - 1)).to_bytes(size, rng.choice(("little", "big")))


def zeros(size: int, packer: Any) -> bytes:
    """Pack many zeros, by a compressor of zlib or zstandard, without having them."""
    block = bytes(1 << 20)
    return b"".join([*(packer.compress(block) for _ in range(size >> 20)), packer.flush()])


BYTES: tuple[Damage, ...] = (
    flip, flip, flip, overwrite, cut, drop, zero, zero_tail, repeat, splice, append, huge_number,
)  # fmt: skip


def odd_text(content: bytearray, rng: random.Random) -> None:
    """Put odd text in the place of a word, or beside it."""
    start = rng.randrange(len(content))
    end = start
    while end < len(content) and content[end] not in b' ,;\t\r\n=[]{}"':
        end += 1
    content[start if rng.random() < 0.7 else end : end] = rng.choice(ODD_TEXTS).encode()


def drop_line(content: bytearray, rng: random.Random) -> None:
    _lines(content, rng, lambda lines, at: lines.pop(at))


def repeat_line(content: bytearray, rng: random.Random) -> None:
    _lines(content, rng, lambda lines, at: lines.insert(rng.randrange(len(lines)), lines[at]))


def swap_lines(content: bytearray, rng: random.Random) -> None:
    def swapped(lines: list[bytes], at: int) -> None:
        other = rng.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]

    _lines(content, rng, swapped)


def line_ends(content: bytearray, rng: random.Random) -> None:
    """End all lines, or one, in another way."""
    end = rng.choice((b"\r", b"\r\n", b"\n\r", b"\n\n", b"\r\r\n", b"\x85", "\u2028".encode(), b"\x0c\n"))
    if rng.random() < 0.5:
        content[:] = content.replace(b"\n", end)
    elif b"\n" in content:
        at = content.index(b"\n", rng.randrange(content.rindex(b"\n") + 1))
        content[at : at + 1] = end


def other_encoding(content: bytearray, rng: random.Random) -> None:
    """Write the text as another program would."""
    text = content.decode("utf-8", "replace")
    content[:] = rng.choice(
        (
            text.encode("utf-8-sig"),
            text.encode("utf-16"),
            text.encode("utf-16-le"),
            text.encode("utf-32"),
            text.encode("latin-1", "replace"),
            text.replace(".", ",").encode(),
        )
    )


def odd_json(content: bytearray, rng: random.Random) -> None:
    """Change one value, key or member of a JSON document; what isn't JSON any more is left."""
    try:
        document = json.loads(bytes(content))
    except (ValueError, RecursionError):
        return
    places = [(None, None), *_json_places(document)]
    parent, key = rng.choice(places)
    odd = rng.choice(ODD_VALUES)
    if parent is None:
        document = odd
    elif isinstance(parent, dict) and rng.random() < 0.3:
        parent[rng.choice(ODD_TEXTS)] = parent.pop(key) if rng.random() < 0.5 else odd
    elif rng.random() < 0.2:
        del parent[key]
    else:
        parent[key] = odd
    text = json.dumps(document, ensure_ascii=rng.random() < 0.5)
    content[:] = text.replace('"RAW', "").replace('WAR"', "").encode("utf-8", "surrogatepass")


def _json_places(document: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(document, dict | list):
        for key in document if isinstance(document, dict) else range(len(document)):
            yield document, key
            yield from _json_places(document[key])


def _lines(content: bytearray, rng: random.Random, change: Callable[[list[bytes], int], object]) -> None:
    lines = bytes(content).split(b"\n")
    change(lines, rng.randrange(len(lines)))
    content[:] = b"\n".join(lines)


TEXTS: tuple[Damage, ...] = (
    odd_text, odd_text, odd_text, drop_line, repeat_line, swap_lines, line_ends, other_encoding, flip, cut, drop,
    splice, repeat, zero, append,
)  # fmt: skip


def damaged(content: bytes, rng: random.Random, kinds: Sequence[Damage], *, most: int = 3) -> tuple[bytes, str]:
    """Damage bytes in one to three ways; give them and the names of the ways."""
    found, done = bytearray(content), []
    for damage in rng.choices(kinds, k=rng.choice((1, 1, 1, 2, most))):
        if found:
            damage(found, rng)
            done.append(damage.__name__)
    return bytes(found), " ".join(done)
