"""The parts that pages are laid out of, all in one look."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from chladni.viewers.bench.theme import TEXT_CSS, WIDGET_CSS

# Panel's classes are typed in part only.
pn: Any = import_module("panel")

WIDE = "stretch_width"
#: For a column whose last part takes the height that is left.
# Panel would add up the heights of the parts, as if they could not shrink.
FILLING = ":host { flex: 1 1 auto !important; min-height: 0 !important; height: auto !important; }"
# What a widget's words are called: Panel renamed it in version 1.9.
_LABEL = "label" if "label" in pn.widgets.Widget.param else "name"


def html(text: str = "", *css: str, **layout: Any) -> Any:
    """Markup of our own; what comes from outside is escaped before."""
    return pn.pane.HTML(text, **{"sizing_mode": WIDE, "margin": 0, **layout, "stylesheets": [TEXT_CSS, *css]})


def column(*parts: Any, **layout: Any) -> Any:
    """Parts below each other."""
    return pn.Column(*parts, **{"sizing_mode": WIDE, "margin": 0, **layout})


def row(*parts: Any, **layout: Any) -> Any:
    """Parts side by side."""
    return pn.Row(*parts, **{"margin": 0, **layout})


def flow(*parts: Any, gap: str = "6px", justify: str = "start", **layout: Any) -> Any:
    """Parts side by side as far as there is room, then below."""
    # Not Panel's box for that: its template becomes a function, which the server's policy for content forbids.
    styles = {"flex-wrap": "wrap", "gap": gap, "justify-content": justify, "align-items": "start"}
    return pn.Row(*parts, **{"sizing_mode": WIDE, "margin": 0, "styles": styles, **layout})


def drawing(figure: Any, *css: str, **layout: Any) -> Any:
    """Show a figure, or another part, of Bokeh."""
    return pn.pane.Bokeh(figure, **{"margin": 0, **layout, "stylesheets": list(css)})


def button(label: str, pressed: Callable[[Any], None] | None, *css: str, **layout: Any) -> Any:
    """Show a button; a label only when nothing happens by pressing it."""
    made = pn.widgets.Button(**{_LABEL: label, "margin": 0, **layout, "stylesheets": [WIDGET_CSS, *css]})
    if pressed is not None:
        made.on_click(pressed)
    return made


def views(names: tuple[str, ...], chosen: Callable[[Any], None]) -> Any:
    """Buttons of which one is down."""
    made = pn.widgets.RadioButtonGroup(options=list(names), value=names[0], margin=0, stylesheets=[WIDGET_CSS])
    made.param.watch(chosen, "value")
    return made


def switch(label: str, on: bool, turned: Callable[[Any], None]) -> Any:
    """Show a box to tick."""
    made = pn.widgets.Checkbox(value=on, margin=(0, 0, 4, 0), stylesheets=[WIDGET_CSS], **{_LABEL: label})
    made.param.watch(turned, "value")
    return made


def choice(
    label: str,
    words: list[str] | dict[str, str],
    chosen: str | None,
    changed: Callable[[Any], None],
    *,
    css: str = "",
    **layout: Any,
) -> Any:
    """Show a list to choose one word of, or one of the values that words stand for."""
    made = pn.widgets.Select(
        options=words,
        value=chosen,
        **{_LABEL: label, "margin": (0, 0, 4, 0), **layout},
        stylesheets=[WIDGET_CSS, css],
    )
    made.param.watch(changed, "value")
    return made


def seconds_entry(label: str, value: float, changed: Callable[[Any], None]) -> Any:
    """Entry of a time that isn't negative."""
    made = pn.widgets.FloatInput(
        value=value, step=1.0, start=0.0, width=96, margin=0, stylesheets=[WIDGET_CSS], **{_LABEL: label}
    )
    made.param.watch(changed, "value")
    return made


def slider(label: str, *css: str, start: float, end: float, step: float, value: float, **layout: Any) -> Any:
    """Show a slider without words; the knob around it says them."""
    return pn.widgets.FloatSlider(
        start=start, end=end, step=step, value=value, show_value=False, tooltips=False,
        sizing_mode=WIDE, stylesheets=[WIDGET_CSS, *css], **{_LABEL: label, **layout},
    )  # fmt: skip


def entry(text: str, *css: str, **layout: Any) -> Any:
    """Show a line of text to type in."""
    return pn.widgets.TextInput(value=text, margin=0, stylesheets=[WIDGET_CSS, *css], **{_LABEL: "", **layout})
