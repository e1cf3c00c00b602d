"""How much memory a log may ask for before it is refused."""

from dataclasses import dataclass

MIB = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Upper bounds on what is read into memory on the word of a log.

    A length field in a damaged or hostile log can claim anything up to 2^64 bytes, and a few
    kilobytes of compressed zeros expand to gigabytes. What claims more than these bounds is
    left out and reported as damage; a log that is larger for good reason is read with
    ``open_log(path, limits=Limits(chunk_bytes=...))``.

    Parameters
    ----------
    record_bytes
        Largest Message outside chunks, in bytes.
    chunk_bytes
        Largest chunk, compressed or uncompressed, in bytes.
    summary_bytes
        Largest summary section, in bytes. A larger one isn't used: the log is read from its start.
    definition_bytes
        Largest total of all distinct Schema and Channel records, in bytes.
    expanded_bytes
        Largest total of all chunks once they are decompressed, in bytes, for a file that is 256 times smaller;
        a larger file may hold 256 times its size.

    Examples
    --------
    >>> Limits(chunk_bytes=2 << 30).chunk_bytes
    2147483648
    """

    record_bytes: int = 256 * MIB
    chunk_bytes: int = 256 * MIB
    summary_bytes: int = 64 * MIB
    definition_bytes: int = 64 * MIB
    expanded_bytes: int = 1024 * MIB

    def excess(self, name: str, value: int) -> str | None:
        """Return the sentence that refuses ``value`` bytes, or None when the limit allows it."""
        limit: int = getattr(self, name)
        if value <= limit:
            return None
        remedy = f"raise it with open_log(..., limits=Limits({name}=...))"
        return f"claims {value} bytes, above the limit {name}={limit}; {remedy}"
