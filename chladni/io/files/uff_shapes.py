"""Modes as data at nodes: datasets 55 and 2414 of complex eigenvalues, and of normal modes."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, hypot, inf, isclose, isfinite, nan, pi, sqrt

import numpy as np

from chladni.io.files.uff_header import TYPE_OF_UNIT
from chladni.io.files.uff_records import TextBlock, block_text, id_line, integer_line, real_lines
from chladni.signals.mode_set import ModeSet

SHAPES, ANALYSIS_DATA = 55, 2414
_STRUCTURAL = 1
_NORMAL_MODE, _COMPLEX_FIRST, _COMPLEX_SECOND = 2, 3, 7
_REAL, _COMPLEX = 2, 5
# In double precision, which dataset 2414 has too.
_REALS, _COMPLEXES = (_REAL, 4), (_COMPLEX, 6)
_AT_NODES = 1
_TRANSLATIONS, _SIX = 2, 3
_ID_LINES = 5
_UNIT_OF_TYPE = {code: unit for unit, code in TYPE_OF_UNIT.items()}
# Six digits in the record: a number in full on an identification line must round to the same.
_SIX_DIGITS = 1e-5
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?(?:e[-+]?\d+)?|nan|inf)"
_IN_FULL = {name: re.compile(rf"^{name}=({_NUMBER}) std=({_NUMBER})$") for name in ("frequency_hz", "damping_ratio")}
_SCALE = re.compile(rf"^modal_mass_std=({_NUMBER}) response=(\d{{1,9}}):([+-]\d) reference=(\d{{1,9}}):([+-]\d)$")

Degree = tuple[int, int]
"""Node and axis: 1 to 3 translations along x, y, z, 4 to 6 rotations about them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeMode:
    """One mode as a universal file has it, in SI.

    Attributes
    ----------
    frequency_hz, frequency_std_hz, damping_ratio, damping_std
        NaN where the file doesn't say.
    motion
        Complex motion by node and axis, not zero.
    modal_a
        Modal A in the scale of `motion`, 0 when unscaled; `modal_mass` likewise, in kg.
    unit
        Of the motion that was measured, ``1`` when the file doesn't say.
    driving
        Node and signed axis of the response and of the reference that scaled the mode; None when unknown.
    """

    frequency_hz: float
    frequency_std_hz: float
    damping_ratio: float
    damping_std: float
    motion: Mapping[Degree, complex]
    modal_a: complex
    modal_mass: float
    modal_mass_std: float
    unit: str
    driving: tuple[Degree, Degree] | None


def shape_blocks(
    modes: ModeSet,
    motions: Sequence[Mapping[Degree, complex]],
    *,
    unit: str,
    driving: tuple[Degree, Degree] | None,
) -> str:
    """Write each mode as a dataset 55 of a complex eigenvalue (analysis type 3, complex values).

    Parameters
    ----------
    motions
        Motion of each mode by node and axis.
    unit
        Of the motion that was measured, in which the shapes are; ``1`` when they're mixed.
    driving
        Node and signed axis of the driving point; None leaves the modes unscaled.

    Notes
    -----
    Record 8 holds eigenvalue [rad/s], modal A and modal B = -lambda A (0 when unscaled). Identification lines 2 to 4
    hold frequency, damping and modal mass in full, with one sigma, which record 8 has no place for.
    """
    six = any(axis > 3 for motion in motions for _, axis in motion)
    rows = [_record(modes, row, motion, unit, driving, six=six) for row, motion in enumerate(motions)]
    return "".join(block_text(SHAPES, lines) for lines in rows)


def read_shapes(
    blocks: Sequence[TextBlock], kilograms: Sequence[float]
) -> tuple[tuple[NodeMode, ...], tuple[str, ...]]:
    """Read the modes among datasets 55 and 2414, and give sentences on those that are no modes.

    Normal modes (analysis type 2) and complex modes (3, 7) are read, real or complex, with three or six values a
    node. An eigenvalue of negative frequency is taken with the conjugate of its shape, which is the same mode.

    Parameters
    ----------
    kilograms
        By what masses are divided to get kg, for each dataset of the file.

    Raises
    ------
    LogError
        When a dataset is cut short or holds what is no number.
    """
    modes, notes = [], []
    for block in (one for one in blocks if one.kind in (SHAPES, ANALYSIS_DATA)):
        data = _at_nodes(block) if block.kind == SHAPES else _analysis_data(block)
        start = f"{block.where}: line {block.first_line}: a dataset {block.kind} was left out: "
        if data.location != _AT_NODES:
            notes.append(f"{start}its data aren't at nodes.")
        elif data.analysis not in (_NORMAL_MODE, _COMPLEX_FIRST, _COMPLEX_SECOND):
            notes.append(f"{start}its analysis type {data.analysis} is no mode.")
        elif data.width not in (3, 6):
            notes.append(f"{start}it has {data.width} values a node, where translations have 3, with rotations 6.")
        else:
            mode = _read_mode(block, data, kilograms[block.number])
            if 0 < mode.frequency_hz < inf and abs(mode.damping_ratio) < 1 and mode.motion:
                modes.append(mode)
            else:
                notes.append(f"{start}it doesn't oscillate ({mode.frequency_hz:g} Hz), or nothing moves in it.")
    return tuple(modes), tuple(notes)


def _record(
    modes: ModeSet,
    row: int,
    motion: Mapping[Degree, complex],
    unit: str,
    driving: tuple[Degree, Degree] | None,
    *,
    six: bool,
) -> list[str]:
    pole = complex(modes.poles[row])
    modal_a = 0j if modes.scale is None or driving is None else complex(modes.scale.modal_a[row])
    # 0 says unscaled, which NaN, no number in a file, can't.
    modal_a = modal_a if isfinite(abs(modal_a)) else 0j
    modal_b = -pole * modal_a
    width = 6 if six else 3
    definition = (_STRUCTURAL, _COMPLEX_FIRST, _SIX if six else _TRANSLATIONS, TYPE_OF_UNIT.get(unit, 0), _COMPLEX)
    lines = [
        id_line(f"chladni mode {row + 1} of {modes.frequency_hz.size}, {modes.provenance.estimator}"),
        id_line(f"frequency_hz={modes.frequency_hz[row]:.17g} std={modes.frequency_std_hz[row]:.9g}"),
        id_line(f"damping_ratio={modes.damping_ratio[row]:.17g} std={modes.damping_std[row]:.9g}"),
        id_line(_scale_line(modes, row, driving)),
        id_line(""),
        integer_line(*definition, width),
        integer_line(2, 6, 1, row + 1),
        *real_lines([part for number in (pole, modal_a, modal_b) for part in (number.real, number.imag)]),
    ]
    for node in dict.fromkeys(node for node, _ in motion):
        values = [motion.get((node, axis), 0j) for axis in range(1, width + 1)]
        lines += [integer_line(node), *real_lines([part for one in values for part in (one.real, one.imag)])]
    return lines


def _scale_line(modes: ModeSet, row: int, driving: tuple[Degree, Degree] | None) -> str:
    if modes.scale is None or driving is None:
        return ""
    (node, axis), (source, along) = driving
    std = modes.scale.modal_mass_std[row]
    return f"modal_mass_std={std:.9g} response={node}:{axis:+d} reference={source}:{along:+d}"


@dataclass(frozen=True, slots=True, kw_only=True)
class _NodeData:
    """What a dataset announces of its data, and where these begin.

    `numbers` are frequency, modal mass, viscous and hysteretic damping of a normal mode; the parts of eigenvalue and
    modal A of a complex one.
    """

    location: int
    analysis: int
    quantity: int
    complex_values: bool
    width: int
    numbers: Sequence[float]
    start: int


def _at_nodes(block: TextBlock) -> _NodeData:
    """What a dataset 55 announces."""
    _, analysis, _, quantity, data_type, width = block.integers(_ID_LINES, 6)
    if data_type not in (_REAL, _COMPLEX):
        raise block.mistake(_ID_LINES, f"has the data type {data_type}; 2 is real and 5 complex")
    numbers: Sequence[float] = ()
    index = _ID_LINES + 2
    if analysis in (_NORMAL_MODE, _COMPLEX_FIRST, _COMPLEX_SECOND):
        integers, reals = block.integers(_ID_LINES + 1, 2)
        least = 4 if analysis == _NORMAL_MODE else 6
        if not (1 <= integers <= 10 and least <= reals <= 12):
            raise block.mistake(
                _ID_LINES + 1, f"announces {integers} integers and {reals} numbers, at least {least} due"
            )
        index = _ID_LINES + 1 + ceil((integers + 2) / 8)
        numbers = _numbers(block, index, reals)
        index += ceil(reals / 6)
    return _NodeData(
        location=_AT_NODES,
        analysis=analysis,
        quantity=quantity,
        complex_values=data_type == _COMPLEX,
        width=width,
        numbers=numbers,
        start=index,
    )


def _analysis_data(block: TextBlock) -> _NodeData:
    """What a dataset 2414 announces: twelve numbers of all analysis types together, those of others zero."""
    (location,) = block.integers(2, 1)
    _, analysis, _, quantity, data_type, width = block.integers(8, 6)
    reals = [number for index in (11, 12) for number in block.reals(index, 6)]
    if location == _AT_NODES and data_type not in (*_REALS, *_COMPLEXES):
        raise block.mistake(8, f"has the data type {data_type}; 2 and 4 are real, 5 and 6 complex")
    return _NodeData(
        location=location,
        analysis=analysis,
        quantity=quantity,
        complex_values=data_type in _COMPLEXES,
        width=width,
        numbers=[reals[1], *reals[3:6]] if analysis == _NORMAL_MODE else reals[6:],
        start=13,
    )


def _read_mode(block: TextBlock, data: _NodeData, kilogram: float) -> NodeMode:
    motion = _motion(block, data.start, data.width, complex_values=data.complex_values)
    if data.analysis == _NORMAL_MODE:
        frequency_hz, mass, viscous, hysteretic = data.numbers[:4]
        # Hysteretic damping loses as much a cycle as viscous damping of half its ratio would, at resonance.
        damping = viscous or hysteretic / 2
        modal_a = 2j * (2 * pi * frequency_hz * sqrt(max(1 - damping**2, 0.0))) * mass
    else:
        pole, modal_a = complex(*data.numbers[:2]), complex(*data.numbers[2:4])
        if pole.imag < 0:
            # The conjugate pair is one mode; its half with rising phase is kept, with its own shape and modal A.
            pole, modal_a = pole.conjugate(), modal_a.conjugate()
            motion = {degree: value.conjugate() for degree, value in motion.items()}
        size = hypot(pole.real, pole.imag)
        frequency_hz, damping = size / (2 * pi), -pole.real / size if size else nan
        mass = (modal_a / (2j * pole.imag)).real if pole.imag else 0.0
    mode = NodeMode(
        frequency_hz=frequency_hz,
        frequency_std_hz=nan,
        damping_ratio=damping,
        damping_std=nan,
        motion=motion,
        modal_a=modal_a / kilogram,
        modal_mass=mass / kilogram,
        modal_mass_std=nan,
        unit=_UNIT_OF_TYPE.get(data.quantity, "1"),
        driving=None,
    )
    return _with_identification(block, mode, kilogram) if block.kind == SHAPES else mode


def _with_identification(block: TextBlock, mode: NodeMode, kilogram: float) -> NodeMode:
    """The mode with what identification lines 2 to 4 say in full, as ours do."""
    frequency_hz, frequency_std_hz = _in_full(block.line(1), "frequency_hz", mode.frequency_hz)
    damping_ratio, damping_std = _in_full(block.line(2), "damping_ratio", mode.damping_ratio)
    scale = _SCALE.match(block.line(3).strip())
    return replace(
        mode,
        frequency_hz=frequency_hz,
        frequency_std_hz=frequency_std_hz,
        damping_ratio=damping_ratio,
        damping_std=damping_std,
        modal_mass_std=float(scale[1]) / kilogram if scale else nan,
        driving=((int(scale[2]), int(scale[3])), (int(scale[4]), int(scale[5]))) if scale else None,
    )


def _motion(block: TextBlock, start: int, width: int, *, complex_values: bool) -> dict[Degree, complex]:
    """Components that aren't zero; complex values are pairs, real part first (note 2 of the format)."""
    count = width * (2 if complex_values else 1)
    found: dict[Degree, complex] = {}
    seen: set[int] = set()
    index = start
    while index < len(block.lines):
        if not block.line(index).strip():
            index += 1
            continue
        (node,) = block.integers(index, 1)
        if node <= 0 or node in seen:
            raise block.mistake(index, f"gives node {node}, which is no label or came before")
        seen.add(node)
        parts = np.array(_numbers(block, index + 1, count))
        values = parts[0::2] + 1j * parts[1::2] if complex_values else parts.astype(complex)
        found |= {(node, axis): complex(value) for axis, value in enumerate(values, start=1) if value != 0}
        index += 1 + ceil(count / 6)
    return found


def _numbers(block: TextBlock, index: int, count: int) -> list[float]:
    numbers: list[float] = []
    while len(numbers) < count:
        numbers += block.reals(index, min(6, count - len(numbers)))
        index += 1
    return numbers


def _in_full(line: str, name: str, rounded: float) -> tuple[float, float]:
    """The number and its sigma as an identification line gives them, when it agrees with the record."""
    match = _IN_FULL[name].match(line.strip())
    if match is None or not isclose(float(match[1]), rounded, rel_tol=_SIX_DIGITS * 2, abs_tol=_SIX_DIGITS * 1e-2):
        return rounded, nan
    return float(match[1]), float(match[2])
