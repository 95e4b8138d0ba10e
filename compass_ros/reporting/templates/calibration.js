// How the calibration went: the difference by factor, and each active parameter against the rollouts spent.
const MAX_CURVES = 24;
const calibration = data.calibration;

const panel = (parent, title, named) => {
  const box = element("div", "panel", parent), heading = element("h4", "", box);
  if (named) nameInto(heading, title); else heading.textContent = title;
  return element("div", "plot", box);
};

const spent = (more) => axis({ title: label("rollouts"), nticks: 4, rangemode: "tozero", ...more });

const drawDifference = (target) => {
  const names = Object.keys(calibration.difference), shades = ["calibrated", "with_effects", "nominal", "ink", "bad", "note"];
  draw(target, names.map((name, i) => ({
    x: calibration.difference_rollouts, y: calibration.difference[name], type: "scatter", mode: "lines+markers", name: text(name),
    line: { color: colour(shades[i % shades.length]), width: 1.8 }, marker: { size: 5 }, hovertemplate: `%{y:.4g} ${calibration.difference_unit} ${text(name)}<extra></extra>`,
  })), {
    hovermode: "x unified", xaxis: spent(), yaxis: axis({ title: label(calibration.difference_unit), rangemode: "tozero", nticks: 5 }), showlegend: true,
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 11 } }, margin: { l: 8, r: 8, t: 28, b: 4 },
  });
};

const drawSparsity = (target) => draw(target, [{
  x: calibration.difference_rollouts, y: calibration.sparsity.map((s) => (s === null ? null : 100 * s)), type: "scatter", mode: "lines+markers",
  line: { color: colour("heat"), width: 1.8 }, marker: { size: 5 }, hovertemplate: "%{y:.0f} %<extra></extra>",
}], { xaxis: spent(), yaxis: axis({ range: [0, 105], title: label("%"), nticks: 5 }), margin: { l: 8, r: 8, t: 28, b: 4 } });

const drawCurve = (target, p) => {
  const band = p.value !== null && p.std !== null;
  const known = [...p.path, p.default, p.value, p.truth, band ? p.value - p.std : null, band ? p.value + p.std : null].filter((v) => v !== null && v !== undefined);
  const low = Math.min(...known), high = Math.max(...known), margin = 0.1 * (high - low) || Math.abs(high) * 0.1 || 1;
  const line = (y, name, dash) => ({ type: "line", xref: "paper", x0: 0, x1: 1, y0: y, y1: y, line: { color: colour(name), width: 1.4, dash } });
  const shapes = [line(p.default, "nominal", "dash")];
  if (band) shapes.unshift({ type: "rect", layer: "below", xref: "paper", x0: 0, x1: 1, y0: p.value - p.std, y1: p.value + p.std, fillcolor: faded("calibrated", 0.16), line: { width: 0 } });
  if (p.truth !== null) shapes.push(line(p.truth, "ink", "dot"));
  draw(target, [{
    x: calibration.rollouts, y: p.path, type: "scatter", mode: "lines+markers", line: { color: colour("calibrated"), width: 1.8 }, marker: { size: 4.5 },
    hovertemplate: `%{y:.5g} ${text(p.unit)}<br>%{x} rollouts<extra></extra>`,
  }], { shapes, hovermode: "closest", xaxis: spent({ title: undefined }), yaxis: axis({ range: [low - margin, high + margin], nticks: 4 }), margin: { l: 4, r: 4, t: 6, b: 4 } });
};

if (calibration.difference_rollouts.length < 2) {
  document.getElementById("moved").remove();
} else {
  const wide = document.getElementById("convergence"), small = document.getElementById("curves");
  const difference = panel(wide, "Mean trajectory difference");
  whenSeen(difference, () => drawDifference(difference));
  if (calibration.sparsity.some((s) => s !== null)) {
    const sparsity = panel(wide, "Entries of the graph under the threshold");
    whenSeen(sparsity, () => drawSparsity(sparsity));
  }
  const moved = (p) => Math.abs(p.value - p.default) / (p.bounds[1] - p.bounds[0] || 1);
  for (const p of [...calibration.parameters].filter((q) => q.path.length).sort((a, b) => b.identifiable - a.identifiable || moved(b) - moved(a)).slice(0, MAX_CURVES)) {
    const target = panel(small, p.name, true);
    whenSeen(target, () => drawCurve(target, p));
  }
}
