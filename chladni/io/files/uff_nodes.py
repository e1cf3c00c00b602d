"""Measurement points as numbered nodes (datasets 15, 781, 2411) and their wireframe as trace lines (dataset 82)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from chladni.io.files.uff_records import TextBlock, block_text, id_line, integer_line, real_lines
from chladni.signals.channel import Vector
from chladni.signals.geometry import Geometry, Point

NODES, TRACE_LINES = 15, 82
#: Nodes in double precision, two lines each; 781 is the older number of 2411.
DOUBLE_NODES = (781, 2411)
_WIDTH, _DOUBLE_WIDTH = 13, 25
_FIELDS = 7
_A_LINE = 8
_LONGEST_TRACE = 250
_ID_LENGTH = 80
_LARGEST_NODE = 10**9
_NAMES_APART = " > "


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeGeometry:
    """Nodes as a universal file has them.

    Attributes
    ----------
    positions
        Position in metres by node.
    lines
        Nodes of each trace line.
    names
        Name by node, where a trace line says it; the others are named by their number.
    notes
        Sentences on what was taken how.
    """

    positions: Mapping[int, Vector]
    lines: tuple[tuple[int, ...], ...]
    names: Mapping[int, str]
    notes: tuple[str, ...]

    def name(self, node: int) -> str:
        """Name of a node as a point."""
        return self.names.get(node, str(node))

    def geometry(self) -> Geometry:
        """The same by names."""
        points = tuple(Point(name=self.name(node), position=place) for node, place in self.positions.items())
        return Geometry(points=points, lines=tuple(tuple(self.name(node) for node in line) for line in self.lines))


def number_points(names: Iterable[str]) -> dict[str, int]:
    """Number points: a name that is a number keeps it, the others take the smallest that are free.

    Examples
    --------
    >>> number_points(["base", "1", "wrist"])
    {'base': 2, '1': 1, 'wrist': 3}
    """
    unique = list(dict.fromkeys(names))
    own = {name: int(name) for name in unique if _is_label(name)}
    free = (number for number in range(1, len(unique) + len(own) + 1) if number not in own.values())
    return {name: own[name] if name in own else next(free) for name in unique}


def node_blocks(geometry: Geometry, nodes: Mapping[str, int], unplaced: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Write datasets 15 and 82, and give sentences on what doesn't fit them.

    Parameters
    ----------
    nodes
        Node by point.
    unplaced
        Points of channels that the geometry doesn't know; written at the origin when there's a geometry at all.
    """
    if not geometry.points:
        return "", ()
    places = {point.name: point.position for point in geometry.points}
    places |= dict.fromkeys(unplaced, (0.0, 0.0, 0.0))
    rows = [integer_line(nodes[name], 0, 0, 0) + real_lines(place)[0] for name, place in places.items()]
    losses = [f"{name}: has no position; node {nodes[name]} was written at the origin." for name in unplaced]
    text = block_text(NODES, rows)
    said: set[str] = set()
    trace = 0
    for line in geometry.lines:
        for part in _parts(line):
            trace += 1
            names = _NAMES_APART.join(part)
            told = len(names) <= _ID_LENGTH and names.isascii() and names.isprintable()
            said.update(part if told else ())
            # Names that don't fit the line are left out as a whole: half a list would name the wrong nodes.
            numbers = [nodes[name] for name in part]
            rows = [integer_line(*numbers[start : start + _A_LINE]) for start in range(0, len(numbers), _A_LINE)]
            text += block_text(
                TRACE_LINES, [integer_line(trace, len(numbers), 0), id_line(names if told else ""), *rows]
            )
        if len(line) > _LONGEST_TRACE:
            losses.append(f"A line through {len(line)} points was cut into trace lines of {_LONGEST_TRACE} nodes.")
    losses += [
        f"{name}: the point became node {nodes[name]}; a universal file numbers its points."
        for name in places
        if name not in said and str(nodes[name]) != name
    ]
    return text, tuple(losses)


def read_nodes(blocks: Sequence[TextBlock], metres: Sequence[float]) -> NodeGeometry:
    """Read datasets 15, 781, 2411 and 82.

    Parameters
    ----------
    metres
        By what coordinates are divided to get metres, for each dataset of the file.

    Raises
    ------
    LogError
        When a line is no node, a node has two positions, or a trace line goes through a node that isn't there.
    """
    positions: dict[int, Vector] = {}
    local = False
    for block in blocks:
        if block.kind in (NODES, *DOUBLE_NODES):
            local = _read_positions(block, metres[block.number], positions) or local
    lines: list[tuple[int, ...]] = []
    names: dict[int, str] = {}
    for block in blocks:
        if block.kind == TRACE_LINES:
            whole = _read_trace(block)
            names |= _names_of(block.line(1), whole)
            lines += [_known(block, positions, part) for part in whole if len(part) > 1]
    if len(set(names.values())) < len(names) or any(
        names.get(node, "") != str(node) for node in _clash(names, positions)
    ):
        names = {}
    note = (
        "Nodes have coordinate systems of their own (datasets 18, 2420), which aren't read; positions and directions "
        "are taken as global."
    )
    return NodeGeometry(positions=positions, lines=tuple(lines), names=names, notes=(note,) if local else ())


def _read_positions(block: TextBlock, metre: float, positions: dict[int, Vector]) -> bool:
    """Add the nodes of a dataset; says whether one has a coordinate system of its own."""
    local = False
    width = _DOUBLE_WIDTH if block.kind in DOUBLE_NODES else _WIDTH
    for (index, head), (below, tail) in _node_lines(block):
        node, definition, displacement, _ = replace(
            block, first_line=block.first_line + index, lines=(head,)
        ).integers(0, 4)
        x, y, z = replace(block, first_line=block.first_line + below, lines=(tail,)).reals(0, 3, width=width)
        place = (x / metre, y / metre, z / metre)
        if node <= 0:
            raise block.mistake(index, f"numbers a node {node}; nodes count from 1")
        if positions.setdefault(node, place) != place:
            raise block.mistake(index, f"gives node {node} a second position; remove one")
        local = local or definition not in (0, 1) or displacement not in (0, 1)
    return local


def _node_lines(block: TextBlock) -> Iterator[tuple[tuple[int, str], tuple[int, str]]]:
    """Labels and coordinates of each node with the index of their line: one, or two in double precision."""
    lines = [(index, line) for index, line in enumerate(block.lines) if line.strip()]
    if block.kind in DOUBLE_NODES:
        if len(lines) % 2:
            raise block.mistake(lines[-1][0], "ends before the coordinates of its last node")
        yield from zip(lines[::2], lines[1::2], strict=True)
        return
    for index, line in lines:
        words = line.split()
        # Coordinates may touch, so that blanks don't tell them apart.
        head, tail = (" ".join(words[:4]), " ".join(words[4:])) if len(words) == _FIELDS else (line[:40], line[40:])
        yield (index, head), (index, tail)


def _read_trace(block: TextBlock) -> list[tuple[int, ...]]:
    """Nodes of a trace line, cut where it lifts the pen (node 0)."""
    count = block.integers(0, 3)[1] if len(block.line(0).split()) > 2 else block.integers(0, 2)[1]
    # Each number takes a column, so a dataset can't hold more than its characters.
    if not 0 <= count <= sum(len(line) for line in block.lines):
        raise block.mistake(0, f"announces {count} nodes, which it can't hold")
    numbers: list[int] = []
    index = 2
    while len(numbers) < count:
        due = min(_A_LINE, count - len(numbers))
        numbers += block.integers(index, due)
        index += 1
    parts: list[list[int]] = [[]]
    for number in numbers:
        if number == 0:
            parts.append([])
        elif not parts[-1] or parts[-1][-1] != number:
            parts[-1].append(number)
    return [tuple(part) for part in parts]


def _known(block: TextBlock, positions: Mapping[int, Vector], part: tuple[int, ...]) -> tuple[int, ...]:
    for node in part:
        if node not in positions:
            raise block.mistake(0, f"draws a line through node {node}, which dataset 15 doesn't have")
    return part


def _names_of(text: str, parts: Sequence[tuple[int, ...]]) -> dict[int, str]:
    """Names that the identification line gives to the nodes of one trace line, as ours do."""
    names = [name.strip() for name in text.split(_NAMES_APART.strip())]
    if len(parts) != 1 or len(names) != len(parts[0]) or len(names) < 2 or not all(names):
        return {}
    return dict(zip(parts[0], names, strict=True))


def _clash(names: Mapping[int, str], positions: Mapping[int, Vector]) -> list[int]:
    """Nodes whose number is the name of another node."""
    return [node for node in positions if str(node) in names.values() and names.get(node) != str(node)]


def _parts(line: tuple[str, ...]) -> list[tuple[str, ...]]:
    # Each part begins where the last one ended, so that the drawing stays whole.
    step = _LONGEST_TRACE - 1
    return [line[start : start + _LONGEST_TRACE] for start in range(0, max(len(line) - 1, 1), step)]


def _is_label(name: str) -> bool:
    return name.isascii() and name.isdecimal() and str(int(name)) == name and 0 < int(name) < _LARGEST_NODE
