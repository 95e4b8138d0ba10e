// Small figures, one a number: what each run or unit says of it, with error bars.
document.querySelectorAll(".panels.sheet").forEach((parent, part) => data[part].forEach((figure) => {
  const panel = element("div", "panel", parent);
  nameInto(element("h4", "", panel), figure.name);
  const plot = element("div", "plot", panel);
  whenSeen(plot, () => {
    const places = figure.places.map((_, i) => i);
    const shift = (i) => (figure.series.length > 1 && !figure.series[i].joined ? 0.16 * (i - (figure.series.length - 1) / 2) : 0);
    draw(plot, figure.series.map((one, i) => ({
      type: "scatter", mode: one.joined ? "lines+markers" : "markers", name: text(one.name), connectgaps: false,
      x: places.map((x) => x + shift(i)), y: one.y, customdata: figure.places.map(text),
      error_y: { type: "data", array: one.error, visible: one.error.length > 0, thickness: 1.4, width: 0, color: faded(one.colour, 0.6) },
      marker: { size: 7, color: colour(one.colour) }, line: { width: 1.4, color: faded(one.colour, 0.5) },
      hovertemplate: `%{customdata}: %{y:.4g} ${text(figure.unit)}<extra>${text(one.name)}</extra>`,
    })), {
      xaxis: axis({ tickvals: places, ticktext: figure.places.map((place) => text(place.length > 10 ? `${place.slice(0, 9)}…` : place)), showgrid: false, tickangle: places.length > 6 ? -60 : 0, range: [-0.5, places.length - 0.5] }),
      yaxis: axis({ title: label(text(figure.unit)), type: figure.log ? "log" : "linear", nticks: 5, ...(figure.share ? { range: [-0.05, 1.05] } : {}) }),
      shapes: figure.band ? [{ type: "rect", layer: "below", xref: "paper", x0: 0, x1: 1, y0: figure.band[0], y1: figure.band[1], fillcolor: faded("with_effects", 0.14), line: { width: 0 } }] : [],
    });
  });
}));
