"""Kinds of input that files of the world have, each with a truth in closed form."""

from case_kinds import arrays, bad_parts, clocks, messages, modal_kinds, publishers, tables, universal_kinds
from case_kinds.judging import Case

MODULES = (arrays, bad_parts, clocks, messages, modal_kinds, publishers, tables, universal_kinds)


def all_cases() -> list[Case]:
    """Every case, kind after kind by name."""
    return sorted((case for module in MODULES for case in module.cases()), key=lambda case: case.kind)
