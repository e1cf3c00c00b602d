"""JSON messages as one stream for a parser, one message a line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from chladni.signals.arrays import Bytes, Whole

WHITE_SPACE: Final = b" \t\r\n"
"""What JSON counts as white space; `bytes.strip` alone would take more."""

_IS_WHITE: Final = np.isin(np.arange(256), np.frombuffer(WHITE_SPACE, np.uint8))
_MOST_TRIMMED: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Span:
    """Places of messages in a buffer, inside of it.

    Parameters
    ----------
    buffer : uint8 array
    starts, ends : int64 array [message]
    """

    buffer: Bytes
    starts: Whole
    ends: Whole

    def __len__(self) -> int:
        return len(self.starts)

    def part(self, first: int, last: int) -> Span:
        """Messages `first` up to, not including, `last`."""
        return Span(buffer=self.buffer, starts=self.starts[first:last], ends=self.ends[first:last])

    def contents(self) -> list[bytes]:
        """Each message, without the white space around it."""
        return [
            self.buffer[start:end].tobytes().strip(WHITE_SPACE)
            for start, end in zip(self.starts.tolist(), self.ends.tolist(), strict=True)
        ]

    def trimmed(self) -> Span:
        """Without white space at the ends of the messages, as far as it is a few bytes."""
        ends = self.ends
        for _ in range(_MOST_TRIMMED):
            white = _IS_WHITE[self.buffer[ends - 1]] & (ends - 1 > self.starts)
            if not white.any():
                break
            ends = ends - white
        return Span(buffer=self.buffer, starts=self.starts, ends=ends)

    def lines(self) -> bytes | None:
        """Join objects by newlines.

        Returns
        -------
        bytes or None
            As many objects, or more, as there are messages, with a newline and perhaps spaces between messages.
            None where a message doesn't begin with ``{`` and end with ``}``, holds a newline or a NUL, or isn't
            UTF-8: nothing can then be said of which message an object of the stream belongs to.
        """
        if (self.ends <= self.starts).any():
            return None
        span = self.trimmed()
        if (span.buffer[span.starts] != ord("{")).any() or (span.buffer[span.ends - 1] != ord("}")).any():
            return None
        stream = span.joined()
        if b"\0" in stream or stream.count(b"\n") != len(span) - 1:
            return None
        return stream if _is_utf8(stream) else None

    def joined(self) -> bytes:
        """Messages with a newline, and perhaps spaces, between them."""
        gaps = self.starts[1:] - self.ends[:-1]
        width = int(gaps[0]) if len(gaps) else 0
        if not 0 < width <= 64 or (gaps != width).any():
            return b"\n".join(self.contents())
        # The usual case in a chunk: what lies between is a record's header. Blanking it in a copy is several times
        # faster than taking the messages one by one.
        first = int(self.starts[0])
        stretch = self.buffer[first : int(self.ends[-1])].copy()
        windows = np.lib.stride_tricks.sliding_window_view(stretch, width, writeable=True)
        windows[self.ends[:-1] - first] = np.frombuffer(b"\n" + b" " * (width - 1), np.uint8)
        return stretch.tobytes()


def _is_utf8(stream: bytes) -> bool:
    if stream.isascii():
        return True
    try:
        stream.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True
