"""The checksum over all data of a log, the only protection of messages outside chunks."""

from isal import isal_zlib

from chladni.io.mcap.log_file import LogFile
from chladni.io.mcap.summary import LogEnd
from chladni.signals.arrays import Bytes

_BLOCK_BYTES = 1 << 20


class DataCrc:
    """CRC-32 from the start of the log up to DataEnd, kept in step with the walk so that pages are read once.

    Parameters
    ----------
    file, end
        The log, and what its end tells.
    """

    def __init__(self, file: LogFile, end: LogEnd) -> None:
        self._file = file
        self._end = end
        self._position = 0
        self._crc = 0

    @property
    def wanted(self) -> bool:
        """Whether the log carries such a checksum."""
        return self._end.data_crc != 0

    def take(self, offset: int, content: Bytes) -> None:
        """Take in bytes that have been read already, and those of the file before them."""
        self._read_to(offset)
        if self._position == offset:
            self._crc = isal_zlib.crc32(content.data, self._crc)
            self._position += len(content)

    def _read_to(self, offset: int) -> None:
        while self._position < offset:
            block = self._file.read(self._position, min(_BLOCK_BYTES, offset - self._position))
            if not block:
                return
            self._crc = isal_zlib.crc32(block, self._crc)
            self._position += len(block)

    def is_right(self) -> bool:
        """Take in the rest and compare."""
        self._read_to(self._end.data_end)
        return self._crc == self._end.data_crc
