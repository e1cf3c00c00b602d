"""The two scripts of a page with plots: Bokeh's library, and what draws the plots as they come into sight."""

import json
from functools import cache

from bokeh.resources import Resources

from chladni.viewers.screen_colours import DARK


@cache
def library() -> str:
    """Give Bokeh's own script, the smallest of its parts that draws plots."""
    (code, *_) = Resources(mode="inline", minified=True, components=["bokeh"]).js_raw
    return str(code)


#: No `eval`, no requests: the page's policy lets nothing else run. Plots are made when they come into sight, so that
#: a page of a hundred opens at once; their colours follow the scheme of the reader's screen.
START = """
"use strict";
(() => {
  Bokeh.logger.set_level("warn");
  const swaps = new Map(Object.entries(SWAPS));
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  const light = new WeakMap();
  const documents = [];
  const swapped = (colour) => {
    if (swaps.has(colour)) { return swaps.get(colour); }
    const parts = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/.exec(colour);
    if (parts == null) { return colour; }
    const values = parts.slice(1).map((part) => parseInt(part, 16));
    if (Math.max(...values) - Math.min(...values) > 24) { return colour; }
    return "#" + values.map((value) => Math.round(40 + 0.82 * (255 - value)).toString(16).padStart(2, "0")).join("");
  };
  const paint = (document, dark) => {
    for (const model of document.all_models) {
      for (const name of Object.keys(model.properties)) {
        if (!name.endsWith("_color") || name === "nan_color") { continue; }
        if (!light.has(model)) { light.set(model, new Map()); }
        const kept = light.get(model);
        if (!kept.has(name)) { kept.set(name, model[name]); }
        const was = kept.get(name);
        const plain = typeof was === "string" ? was : was?.value;
        if (typeof plain !== "string") { continue; }
        const colour = dark ? swapped(plain) : plain;
        model[name] = typeof was === "string" ? colour : {value: colour};
      }
    }
  };
  const together = (document) => {
    const named = [...document.all_models].filter((model) => model.type === "GlyphRenderer" && model.name != null);
    for (const one of named) {
      one.properties.visible.change.connect(() => {
        for (const other of named) { if (other.name === one.name) { other.visible = one.visible; } }
      });
    }
  };
  const draw = async (place) => {
    if (place.dataset.drawn === "yes") { return; }
    place.dataset.drawn = "yes";
    const item = JSON.parse(place.querySelector("script").textContent);
    const shown = await Bokeh.embed.embed_item(item, place.querySelector("div").id);
    for (const view of shown) {
      const made = view.model.document;
      if (!documents.includes(made)) {
        documents.push(made);
        together(made);
        paint(made, scheme.matches);
      }
    }
  };
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) { if (entry.isIntersecting) { seen.unobserve(entry.target); draw(entry.target); } }
  }, {rootMargin: "800px"});
  const places = [...document.querySelectorAll(".plot")];
  for (const place of places) { seen.observe(place); }
  scheme.addEventListener("change", () => { for (const made of documents) { paint(made, scheme.matches); } });
  addEventListener("beforeprint", () => {
    for (const place of places) { draw(place); }
    for (const made of documents) { paint(made, false); }
  });
  addEventListener("afterprint", () => { for (const made of documents) { paint(made, scheme.matches); } });
})();
""".replace("SWAPS", json.dumps(DARK))
