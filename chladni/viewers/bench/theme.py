"""Colours and type of the pages, on light and on dark ground."""

from dataclasses import dataclass
from typing import Any, Literal

from chladni.viewers.style import ON_DARK, ON_LIGHT

Ground = Literal["light", "dark"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Theme:
    """One look: the palette of curves and the colours of everything else, as CSS colours."""

    ground: Ground
    palette: tuple[str, ...]
    page: str
    card: str
    line: str
    grid: str
    text: str
    soft: str
    accent: str
    warning: str
    warning_ground: str

    @property
    def other(self) -> Ground:
        """The other ground."""
        return "dark" if self.ground == "light" else "light"

    def variables(self) -> str:
        """Give the colours as CSS custom properties, which reach into every component of the page."""
        # One set of names for both grounds: every stylesheet is written once.
        names = ("page", "card", "line", "grid", "text", "soft", "accent", "warning")
        colours = "".join(f"--c-{name}:{getattr(self, name)};" for name in names)
        return f"{colours}--c-warning-ground:{self.warning_ground};color-scheme:{self.ground};"

    def of_charts(self) -> dict[str, Any]:
        """Give the attributes of Bokeh's theme."""
        font = {"text_font": FONT, "text_color": self.text}
        axis = {
            "axis_line_color": self.line,
            "major_tick_line_color": self.line,
            "minor_tick_line_color": None,
            "major_label_text_color": self.soft,
            "major_label_text_font": FONT,
            "major_label_text_font_size": "11px",
            "axis_label_text_color": self.soft,
            "axis_label_text_font": FONT,
            "axis_label_text_font_size": "11px",
            "axis_label_text_font_style": "normal",
            "axis_label_standoff": 4,
        }
        return {
            "attrs": {
                "Plot": {
                    "background_fill_color": self.card,
                    "border_fill_color": self.card,
                    "outline_line_color": None,
                },
                "Grid": {"grid_line_color": self.grid},
                "Axis": axis,
                "Title": {**font, "text_font_size": "12.5px", "text_font_style": "bold"},
                "Legend": {
                    "label_text_color": self.text,
                    "label_text_font": FONT,
                    "label_text_font_size": "10.5px",
                    "background_fill_color": self.card,
                    "background_fill_alpha": 0.75,
                    "border_line_color": None,
                    "glyph_width": 16,
                    "glyph_height": 12,
                    "label_height": 12,
                    "spacing": 1,
                    "padding": 3,
                    "margin": 3,
                },
            }
        }


FONT = "Inter, 'Segoe UI', 'Helvetica Neue', 'DejaVu Sans', sans-serif"

LIGHT = Theme(
    ground="light",
    palette=tuple("#{:02x}{:02x}{:02x}".format(*colour) for colour in ON_LIGHT),
    page="#f4f5f7",
    card="#ffffff",
    line="#c9ced6",
    grid="#eceef1",
    text="#1d2530",
    soft="#566170",
    accent="#0a5f96",
    warning="#8a4b00",
    warning_ground="#fdf3e1",
)
DARK = Theme(
    ground="dark",
    palette=tuple("#{:02x}{:02x}{:02x}".format(*colour) for colour in ON_DARK),
    page="#12161c",
    card="#1a2028",
    line="#3a4450",
    grid="#28303a",
    text="#e6eaf0",
    soft="#9fabb9",
    accent="#6cb8ec",
    warning="#f2b866",
    warning_ground="#33281a",
)


def theme(ground: str) -> Theme:
    """Give the dark look for ``dark``, the light one for every other word."""
    return DARK if ground == "dark" else LIGHT


#: For every widget, inside its own shadow root.
WIDGET_CSS = f"""
:host {{ font-family: {FONT}; font-size: 12.5px; color: var(--c-text); }}
label, .bk-input-group label, .bk-slider-title {{ color: var(--c-soft); font-size: 12px; margin: 0 0 2px 0;
  white-space: normal; }}
.bk-input, input, select {{
  background: var(--c-card); color: var(--c-text); border: 1px solid var(--c-line); border-radius: 4px;
  font-family: inherit; font-size: 12.5px; min-height: 24px; padding: 2px 6px;
}}
select:not([multiple]).bk-input {{ appearance: auto; background-image: none; }}
input[type=checkbox] {{ min-height: 0; accent-color: var(--c-accent); }}
:focus-visible, .bk-input:focus, .noUi-handle:focus {{ outline: 2px solid var(--c-accent); outline-offset: 1px; }}
.bk-btn.bk-btn-default {{
  background: var(--c-card) !important; color: var(--c-text) !important; border: 1px solid var(--c-line) !important;
  border-radius: 5px; box-shadow: none !important; font-family: inherit; font-size: 12.5px; padding: 4px 11px;
}}
.bk-btn.bk-btn-default:hover {{ border-color: var(--c-accent) !important; }}
.bk-btn.bk-btn-default.bk-active {{
  background: var(--c-accent) !important; color: var(--c-card) !important; border-color: var(--c-accent) !important;
}}
.bk-btn:disabled {{ opacity: 0.5; }}
.noUi-target {{ background: var(--c-grid); border-color: var(--c-line); box-shadow: none; }}
.noUi-connect {{ background: var(--c-accent); }}
.noUi-handle {{ background: var(--c-accent); border: 0; box-shadow: none; border-radius: 50%; }}
.noUi-handle::before, .noUi-handle::after {{ display: none; }}
"""

#: For text that the page writes itself.
TEXT_CSS = f"""
:host {{ font-family: {FONT}; font-size: 12.5px; color: var(--c-text); }}
a {{ color: var(--c-accent); }}
table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; }}
th, td {{ padding: 3px 10px 3px 0; text-align: right; border-bottom: 1px solid var(--c-grid); white-space: nowrap; }}
th:first-child, td:first-child {{ text-align: left; }}
th {{ color: var(--c-soft); font-weight: 600; }}
[title] {{ cursor: help; }}
:focus-visible {{ outline: 2px solid var(--c-accent); outline-offset: 1px; border-radius: 2px; }}
"""
