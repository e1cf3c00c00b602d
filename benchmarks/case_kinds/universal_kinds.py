"""Universal files: labels that contradict, abscissae in other units, exponents, number formats."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from case_kinds.checks import Chain, chain_of_masses, check_modes, check_rate, check_tone, check_values
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.product import MismatchError, Product, RefusalError, channel
from case_kinds.universal import (
    ACCELERATION,
    DISPLACEMENT,
    FORCE,
    UNKNOWN,
    VELOCITY,
    Function,
    assert_reads,
    binary_dataset,
    e_notation,
    from_ibm,
    from_vax_f,
    ibm,
    ieee,
    response_functions,
    text_dataset,
    vax_f,
    write_sets,
)

GIVEN_HZ, GIVEN_DAMPING = (39.354, 61.274, 99.048), (0.010, 0.012, 0.015)
RATE_HZ = 200.0
WAVE = np.sin(2 * np.pi * 7 * np.arange(400) / RATE_HZ)
OFFSET_WAVE = 0.3 + np.sin(2 * np.pi * 7 * np.arange(300) / RATE_HZ)


def chain() -> Chain:
    """Three masses with modes near 37, 84 and 124 Hz."""
    return chain_of_masses([2.0, 1.5, 1.0], [4.0e5, 3.5e5, 2.0e5], [0.008, 0.011, 0.014])


def _functions(step_hz: float = 0.25, lines: int = 601) -> tuple[np.ndarray, list[np.ndarray]]:
    frequency = step_hz * np.arange(lines)
    return frequency, [chain().accelerance(frequency, point, 0) for point in range(3)]


def _write_functions(functions: Sequence[Function], folder: Path, *, binary: bool = False) -> Path:
    if binary:
        sets = [binary_dataset(each, 1, 2, ieee(each, "<")) for each in functions]
    else:
        sets = [text_dataset(each) for each in functions]
    path = write_sets(folder / "functions.uff", *sets)
    assert_reads(path, functions)
    return path


def _check_chain(product: Product, path: Path) -> None:
    check_modes(
        product, path, list(chain().frequencies_hz), list(chain().damping), hz_within=2e-4, damping_within=0.02
    )


def _check_given(product: Product, path: Path) -> None:
    check_modes(product, path, GIVEN_HZ, GIVEN_DAMPING, hz_within=2e-4, damping_within=0.02)


# The label of a function is the ratio


def frf_whose_label_is_the_ratio() -> list[Case]:
    """The ordinate's label holds the whole ratio, or nothing at all."""
    kind = "frf_whose_label_is_the_ratio"
    setup_free = {"setup": ('format = "chladni.setup/1"\n[[channel]]\npath = "1:+3"\nunit = "m/s^2"\n',)}

    def made(label: str, ordinate: int, denominator: int, under: str = "NONE", *, order: int = 2,
             scale: float = 1.0, binary: bool = False) -> Callable[[Path], Path]:  # fmt: skip
        def write(folder: Path) -> Path:
            frequency, values = _functions()
            omega = 2j * np.pi * np.where(frequency == 0, 1.0, frequency)
            values = [scale * each / omega ** (2 - order) for each in values]
            fields = {"ordinate_label": label, "ordinate_type": ordinate, "denominator_type": denominator,
                      "denominator_label": under}  # fmt: skip
            return _write_functions(response_functions(values, 0.25, **fields), folder, binary=binary)

        return write

    written = {
        "g_over_N": made("g/N", ACCELERATION, FORCE, scale=1 / 9.80665),
        "mobility": made("(m/s)/N", VELOCITY, FORCE, order=1),
        "receptance": made("m/N", DISPLACEMENT, FORCE, order=0),
        "ratio_over_N_again": made("(m/s^2)/N", ACCELERATION, FORCE, "N"),
        "no_brackets": made("m/s^2/N", ACCELERATION, FORCE),
        "ratio_of_unknown_types": made("(m/s2)/N", UNKNOWN, UNKNOWN),
        "g_over_lbf_binary": made("g/lbf", ACCELERATION, FORCE, scale=4.4482216 / 9.80665, binary=True),
        "types_without_labels": made("NONE", ACCELERATION, FORCE, binary=True),
        "counts_of_nothing_known": made("EU/EU", UNKNOWN, UNKNOWN),
    }
    return [
        Case(kind=kind, name="ratio", write=given(kind, "ratio.uff"), check=_check_given),
        Case(kind=kind, name="no_kind_no_label", write=given(kind, "no_kind_no_label.uff"), check=_check_given),
        *(
            Case(kind=kind, name=name, write=write, check=_check_chain, answers=setup_free)
            for name, write in written.items()
        ),
    ]


# Labels of the abscissa


def _abscissa_time(
    label: str, step: float, *, binary: bool = False, uneven: bool = False, rate_hz: float = RATE_HZ
) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        values = np.sin(2 * np.pi * 7 * np.arange(400) / rate_hz)
        abscissa = step * np.arange(400) if uneven else None
        function = Function(values=values, step=step, abscissa_label=label, abscissa=abscissa)
        data = binary_dataset(function, 2, 2, ieee(function, ">")) if binary else text_dataset(function)
        path = write_sets(folder / "record.uff", data)
        assert_reads(path, [function])
        return path

    return write


def _abscissa_frequency(label: str, scale: float) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        functions = response_functions(_functions()[1], 0.25 * scale, abscissa_label=label)
        return _write_functions(functions, folder)

    return write


def _check_record(rate_hz: float = RATE_HZ, samples: int = 400) -> Check:
    def check(product: Product, path: Path) -> None:
        check_rate(product, path, "1", rate_hz, samples=samples)
        check_tone(product, path, "1", 7.0)

    return check


def _check_orders(product: Product, path: Path) -> None:
    """Orders of a shaft are no frequencies: refused, or said."""
    try:
        product.ask("modes", path)
    except RefusalError as refusal:
        if "order" in str(refusal):
            return
        raise
    if not product.tells(r"\borders?\b.*(abscissa|axis|shaft|speed|not Hz|no frequenc)"):
        raise MismatchError("orders are read as Hz without a word")


def uff_abscissa_label() -> list[Case]:
    """The abscissa is in another unit than s or Hz."""
    kind = "uff_abscissa_label"
    rows = [
        ("time_in_ms", given(kind, "time_in_ms.uff"), _check_record()),
        ("frequency_in_kHz", given(kind, "frequency_in_kHz.uff"), _check_given),
        ("frequency_in_rpm", _abscissa_frequency("rpm", 60.0), _check_chain),
        ("time_in_us", _abscissa_time("us", 5000.0), _check_record()),
        ("time_in_micro_sign_latin1", _abscissa_time("µs", 500.0, rate_hz=2000.0), _check_record_of(2000.0)),
        ("time_in_msec_binary", _abscissa_time("msec", 5.0, binary=True), _check_record()),
        ("time_in_seconds_spelt", _abscissa_time("Seconds", 0.005), _check_record()),
        ("uneven_time_in_ms", _abscissa_time("ms", 5.0, uneven=True), _check_record()),
        ("frequency_in_RPM_capitals", _abscissa_frequency("RPM", 60.0), _check_chain),
        ("frequency_in_cpm", _abscissa_frequency("CPM", 60.0), _check_chain),
        ("frequency_in_rad_s", _abscissa_frequency("rad/s", 2 * np.pi), _check_chain),
        ("frequency_in_cps", _abscissa_frequency("cps", 1.0), _check_chain),
        ("orders", _abscissa_frequency("orders", 1.0), _check_orders),
    ]
    return [Case(kind=kind, name=name, write=write, check=check) for name, write, check in rows]


def _check_record_of(rate_hz: float) -> Check:
    def check(product: Product, path: Path) -> None:
        check_rate(product, path, "1", rate_hz, samples=400)

    return check


# Exponents


def d_notation(number: float, width: int, digits: int) -> str:
    """Write a number as Fortran writes a double."""
    return e_notation(number, width, digits).replace("e", "D")


def short_notation(number: float, width: int, digits: int) -> str:
    """Write exponents of three digits without their letter, as Fortran does where it has no room."""
    mantissa, exponent = f"{number:.{digits}E}".split("E")
    letter = "" if abs(int(exponent)) > 99 else "E"
    return f"{mantissa}{letter}{int(exponent):+03d}".rjust(width)


def leading_zero_notation(number: float, width: int, digits: int) -> str:
    """Write 0.3D+01, Fortran's normal form of a double."""
    mantissa, exponent = f"{number:.{digits - 1}E}".split("E")
    shifted = f"{float(mantissa) / 10:.{digits}f}" if number else f"{0:.{digits}f}"
    return f"{shifted}D{int(exponent) + (1 if number else 0):+03d}".rjust(width)


def _exponents(function: Function, number: Callable[[float, int, int], str]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        data = text_dataset(function, number)
        path = write_sets(folder / "exponents.uff", data)
        # pyuff reads no D: the same text with an E is what is checked.
        plain = write_sets(folder / "plain.uff", text_dataset(function))
        assert_reads(plain, [function])
        width = 20 if function.double else 13
        line = data.split(b"\n")[13]
        first = line[:width].decode().replace("D", "e").replace("d", "e")
        assert np.isclose(float(first), function.numbers[0], rtol=1e-4)
        return path

    return write


def _check_series(truth: np.ndarray, name: str = "1", *, rate_hz: float = RATE_HZ) -> Check:
    def check(product: Product, path: Path) -> None:
        check_values(product, path, name, truth)
        check_rate(product, path, name, rate_hz, samples=truth.size)

    return check


def uff_exponents() -> list[Case]:
    """Numbers as Fortran writes them."""
    kind = "uff_exponents"
    single, double = Function(values=OFFSET_WAVE), Function(values=OFFSET_WAVE, double=True)
    tiny = Function(values=np.where(np.arange(300) % 5 == 2, 1.5e-120, OFFSET_WAVE), double=True)
    complex_function = response_functions(_functions()[1], 0.25)

    # A zero before the point takes one of six digits.
    five_digits = np.array([float(f"{one:.4e}") for one in OFFSET_WAVE])

    def lower(number: float, width: int, digits: int) -> str:
        return d_notation(number, width, digits).lower()

    def functions_in_d(folder: Path) -> Path:
        plain = write_sets(folder / "plain.uff", *(text_dataset(each) for each in complex_function))
        assert_reads(plain, complex_function)
        return write_sets(folder / "functions.uff", *(text_dataset(each, d_notation) for each in complex_function))

    def crlf(folder: Path) -> Path:
        path = _exponents(double, d_notation)(folder)
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
        return path

    def head_in_d(folder: Path) -> Path:
        data = (
            text_dataset(double, d_notation).replace(b"5.00000e-03", b"5.00000D-03").replace(b"0.00000e", b"0.00000D")
        )
        return write_sets(folder / "head.uff", data)

    rows = [
        ("fortran_d", given(kind, "fortran_d.uff"), _check_series(OFFSET_WAVE)),
        ("double_d", _exponents(double, d_notation), _check_series(OFFSET_WAVE)),
        ("lower_case_d", _exponents(single, lower), _check_series(OFFSET_WAVE)),
        ("leading_zero", _exponents(single, leading_zero_notation), _check_series(five_digits)),
        ("three_digits_without_letter", _exponents(tiny, short_notation), _check_series(tiny.values)),
        ("crlf", crlf, _check_series(OFFSET_WAVE)),
        ("d_in_the_head_too", head_in_d, _check_series(OFFSET_WAVE)),
        ("functions_in_d", functions_in_d, _check_chain),
    ]
    return [Case(kind=kind, name=name, write=write, check=check) for name, write, check in rows]


# Number formats of 58b

MINUS_ONE_LINE = b"\n    -1\n"


def _holds_minus_one(function: Function, at: int, order: str, *, lines: bytes = MINUS_ONE_LINE) -> Function:
    """Numbers whose bytes at one place read like the line that ends a dataset."""
    size = 8 if function.double else 4
    padded = lines + b" " * (-len(lines) % size)
    numbers = np.frombuffer(padded, f"{order}f{size}").astype(float)
    assert np.all(np.isfinite(numbers))
    values = function.values.copy()
    values[at : at + numbers.size] = numbers
    return replace(function, values=values)


def _binary(function: Function, order: int, form: int, encode: Callable[[np.ndarray], bytes],
            byte_count: int | None = None, *, by_pyuff: bool = True) -> Callable[[Path], Path]:  # fmt: skip
    def write(folder: Path) -> Path:
        path = write_sets(folder / "binary.uff", binary_dataset(function, order, form, encode, byte_count=byte_count))
        if by_pyuff:
            assert_reads(path, [function])
        return path

    return write


def _two_sets(folder: Path) -> Path:
    double = Function(values=OFFSET_WAVE, double=True)
    first = _holds_minus_one(double, 11, "<", lines=MINUS_ONE_LINE + b"    -1\n    58\n")
    second = replace(double, response=(2, 1))
    sets = [binary_dataset(each, 1, 2, ieee(each, "<")) for each in (first, second)]
    path = write_sets(folder / "two.uff", *sets)
    assert sets[0].count(b"    -1\n") == 2
    return path


def _check_two(product: Product, path: Path) -> None:
    check_values(product, path, "2:+1", OFFSET_WAVE)
    document = product.info(path)
    if len(document["channels"]) != 2:
        raise MismatchError(f"{len(document['channels'])} channels instead of 2")


def uff_58b_number_format() -> list[Case]:
    """Binary numbers by the header's byte order, format and byte count."""
    kind = "uff_58b_number_format"
    single, double = Function(values=OFFSET_WAVE), Function(values=OFFSET_WAVE, double=True)
    held = _holds_minus_one(double, 100, ">")
    assert np.allclose(from_vax_f(vax_f(OFFSET_WAVE)), OFFSET_WAVE, rtol=1e-6)
    assert np.allclose(from_ibm(ibm(OFFSET_WAVE)), OFFSET_WAVE, rtol=1e-6)
    plain = _check_series(OFFSET_WAVE)

    def three_hundred(product: Product, path: Path) -> None:
        check_rate(product, path, "1", RATE_HZ, samples=300)

    def functions_big(folder: Path) -> Path:
        functions = response_functions(_functions()[1], 0.25)
        path = write_sets(folder / "big.uff", *(binary_dataset(each, 2, 2, ieee(each, ">")) for each in functions))
        assert_reads(path, functions)
        return path

    rows = [
        ("data_holds_minus_one_line", given(kind, "data_holds_minus_one_line.uff"), three_hundred, "no"),
        ("order_and_format_zero", given(kind, "order_and_format_zero.uff"), plain, "yes"),
        ("vax_f", _binary(single, 1, 1, vax_f, by_pyuff=False), plain, "yes"),
        ("vax_f_said_big_endian", _binary(single, 2, 1, vax_f, by_pyuff=False), plain, "yes"),
        ("ibm", _binary(single, 2, 3, ibm, by_pyuff=False), plain, "yes"),
        ("double_big_with_minus_one", _binary(held, 2, 2, ieee(double, ">"), by_pyuff=False),
         _check_series(held.values), "no"),
        ("format_zero_big_double", _binary(double, 0, 0, ieee(double, ">"), by_pyuff=False), plain, "yes"),
        ("format_zero_little_double", _binary(double, 0, 0, ieee(double, "<"), by_pyuff=False), plain, "yes"),
        ("two_sets_with_false_end", _two_sets, _check_two, "no"),
        ("byte_count_zero", _binary(single, 1, 2, ieee(single, "<"), 0, by_pyuff=False), plain, "no"),
        ("functions_big_endian", functions_big, _check_chain, "no"),
    ]  # fmt: skip
    return [
        Case(kind=kind, name=name, write=write, check=check, may_refuse=may)  # type: ignore[arg-type]
        for name, write, check, may in rows
    ]


# Units


def _unit_file(label: str, ordinate: int, *, beside: Sequence[tuple[str, int]] = ()) -> Callable[[Path], Path]:
    """Write records of one sine, each with a label and a type."""

    def write(folder: Path) -> Path:
        functions = [
            Function(values=WAVE, ordinate_label=each, ordinate_type=code, response=(point, 1))
            for point, (each, code) in enumerate([(label, ordinate), *beside], start=1)
        ]
        path = write_sets(folder / "units.uff", *(text_dataset(each) for each in functions))
        assert_reads(path, functions)
        return path

    return write


def unit_files() -> dict[str, dict[str, Callable[[Path], Path | None]]]:
    """Universal files about units, by kind and name."""
    acceleration, unknown = "units_of_acceleration", "units_that_are_not_known"
    return {
        acceleration: {
            "acceleration_ms^-2": given(acceleration, "acceleration_ms^-2.uff"),
            "gs_of_type_12": _unit_file("Gs", ACCELERATION),
            "lb_of_a_force": _unit_file("lb", FORCE),
            "lbs_of_a_force": _unit_file("LBS", FORCE),
            "ms-2_of_type_12": _unit_file("ms-2", ACCELERATION),
            "kg_of_a_force": _unit_file("kg", FORCE),
            "m_of_an_acceleration": _unit_file("m", ACCELERATION),
        },
        unknown: {
            "rpm_beside_acceleration": given(unknown, "rpm_beside_acceleration.uff"),
            "latin1_superscript": given(unknown, "latin1_superscript.uff"),
            "eu_beside_acceleration": _unit_file("EU", UNKNOWN, beside=[("m/s2", ACCELERATION)]),
            "latin1_beside_nonsense": _unit_file("Q%?", UNKNOWN, beside=[("m/s²", ACCELERATION)]),
        },
    }


def unit_of(product: Product, path: Path, name: str) -> str:
    """Unit of a channel as ``info`` lists it, without blanks."""
    unit = channel(product.info(path), name)["unit"]
    return (unit or "").replace(" ", "").replace("²", "^2").replace("·", "*")


def cases() -> list[Case]:
    """Every case about universal files, but for units and modes."""
    return [*frf_whose_label_is_the_ratio(), *uff_abscissa_label(), *uff_exponents(), *uff_58b_number_format()]
