"""The report's sections about modes."""

from chladni.modal.shapes.mode_words import synthesised_from
from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study
from chladni.viewers.mode_tables import advice, first_of_each, mode_table, motion_table
from chladni.viewers.report.markup import element, escaped, table
from chladni.viewers.style import Style

# Of each mode: those that matter, where a large structure has hundreds of neighbours.
MOTIONS_OF_A_MODE = 3


def modes_section(study: Study, modes: ModeSet) -> str:
    """Give the table of modes, or that there is none, with what must be known before they are relied upon."""
    headings, rows = mode_table(modes, study.validation)
    found = table(headings, rows, numbers=range(len(headings))) or element("p", "No mode was found.")
    told = "".join(element("li", escaped(sentence)) for sentence in advice(study, modes, told=study.findings))
    made = element("p", escaped(_made(modes)), class_="note")
    return found + made + (element("ul", told) if told else "")


def relative_motion_section(study: Study, modes: ModeSet, style: Style) -> str:
    """Give the table of relative motion, the greatest of each mode; empty when nothing is known."""
    headings, rows = motion_table(study.relative_motion, modes, style)
    shown = first_of_each(rows, MOTIONS_OF_A_MODE)
    note = "Ratio: motion of the two against each other over the greatest motion of the mode, ± one sigma."
    if any("Δ" in heading for heading in headings):
        note += " Δζ, Δf: what a damper or a spring between the two adds."
    if len(shown) < len(rows):
        note += f" The {MOTIONS_OF_A_MODE} greatest of each mode."
    content = table(headings, shown, numbers=(0, 1, 3, 4, 5))
    return content + element("p", note, class_="note") if content else ""


def _made(modes: ModeSet) -> str:
    method = f"Method: {modes.provenance.estimator}. " if modes.provenance.estimator else ""
    error = ""
    if modes.fit is not None:
        error = f" Error of the synthesis of {synthesised_from(modes)}: {modes.fit.error:.1%}."
    scale = ""
    if modes.scale is not None:
        scale = f" Scaled at {modes.scale.response} over {modes.scale.reference}, greatest component 1."
    return f"{method}± is one sigma.{error}{scale}"
