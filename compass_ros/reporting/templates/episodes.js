// The chosen episode: trajectories on the table, errors over time, and one moment marked in both.
const tablePlot = document.getElementById("table-plot");
const errorPlot = document.getElementById("error-plot");
const curves = [{ key: "real", label: "recorded" }, ...data.models];
const shown = Object.fromEntries(curves.map((curve) => [curve.key, true]));
let episode = 0;

const planar = (track) => track.real.length === 2;
const nearest = (times, t) => times.reduce((best, time, i) => (Math.abs(time - t) < Math.abs(times[best] - t) ? i : best), 0);

const curveTrace = (track, curve) => {
  const path = track[curve.key], real = curve.key === "real", style = STYLE[curve.key];
  const hover = `${text(track.object)}, ${curve.label}<br>%{customdata:.2f} s<br>${data.axes[0]} %{x:.4f} m, ${data.axes[1]} %{y:.4f} m<extra></extra>`;
  return {
    x: path[0], y: path[1], customdata: track.time, hovertemplate: hover, mode: real ? "markers" : "lines", type: "scatter",
    marker: { size: 6.5, color: faded("real", 0.3) }, line: { color: colour(curve.key), width: style.width, dash: style.dash },
  };
};

const momentTraces = () => curves.map((curve) => ({
  x: [], y: [], mode: "markers", type: "scatter", hoverinfo: "skip", visible: shown[curve.key],
  marker: { size: 12, symbol: "circle-open", color: colour(curve.key), line: { width: 2.2 } },
}));

const startMarks = (tracks) => tracks.map((track) => ({
  x: track.real[0][0], y: track.real[1][0], xanchor: "left", yanchor: "bottom", xshift: 6, yshift: 3, showarrow: false,
  text: text(track.object), font: { size: 11, color: colour("soft") },
}));

const startShapes = (tracks) => tracks.filter((track) => data.scene.radius[track.object]).map((track) => {
  const r = data.scene.radius[track.object], x = track.real[0][0], y = track.real[1][0];
  return { type: "circle", layer: "below", x0: x - r, x1: x + r, y0: y - r, y1: y + r, fillcolor: faded("ink", 0.08), line: { width: 0 } };
});

const drawTable = () => {
  const tracks = data.episodes[episode].tracks.filter(planar);
  tablePlot.hidden = !tracks.length;
  if (!tracks.length) return;
  const visible = curves.filter((curve) => shown[curve.key]);
  const order = [...visible.filter((c) => c.key === "real"), ...visible.filter((c) => c.key !== "real")];
  const traces = tracks.flatMap((track) => order.filter((c) => track[c.key]).map((c) => curveTrace(track, c)));
  const box = extent();
  draw(tablePlot, [...traces, ...momentTraces()], {
    ...tableAxes(box), height: tableHeight(tablePlot, box, 0), shapes: [...sceneShapes(), ...startShapes(tracks)], annotations: [...sceneMarks(), ...startMarks(tracks)], hovermode: "closest",
  });
};

// Thousandths of the unit; far below the noise nothing is worth a look, and a logarithm needs an end.
const LOWEST = 0.02;

const drawErrors = () => {
  const tracks = data.episodes[episode].tracks, rows = tracks.length, narrow = errorPlot.clientWidth < 480;
  const traces = [], shapes = [], annotations = [], axes = {};
  const top = Math.max(...tracks.flatMap((t) => data.models.flatMap((m) => t.error_mm[m.key] || [0])).filter((v) => v !== null), data.floor_mm || 0, 1);
  tracks.forEach((track, i) => {
    const n = i ? i + 1 : "", gap = 0.09 / rows;
    axes[`yaxis${n}`] = axis({
      type: "log", range: [Math.log10(LOWEST), Math.log10(top) + 0.15], domain: [1 - (i + 1) / rows + (i < rows - 1 ? gap : 0), 1 - i / rows - gap],
      title: label(data.unit), tickvals: [0.1, 1, 10, 100, 1000], ticktext: ["0.1", "1", "10", "100", "1000"],
    });
    for (const model of data.models.filter((m) => shown[m.key] && track.error_mm[m.key])) {
      const style = STYLE[model.key];
      traces.push({
        x: track.time, y: track.error_mm[model.key].map((e) => (e === null ? null : Math.max(e, LOWEST))), yaxis: `y${n}`, type: "scatter", mode: "lines", name: model.label,
        line: { color: colour(model.key), width: style.width - 0.3, dash: style.dash }, hovertemplate: `%{y:.2f} ${data.unit} ${model.label}<extra></extra>`,
      });
    }
    if (data.floor_mm) shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, yref: `y${n}`, y0: data.floor_mm, y1: data.floor_mm, line: { color: colour("faint"), width: 1.2, dash: "dot" } });
    annotations.push({ xref: "paper", x: 0, yref: "paper", y: 1 - i / rows - gap, yanchor: "bottom", xanchor: "left", showarrow: false, text: `${text(track.object)}: distance to the recording${i === 0 && data.floor_mm ? "; dotted: noise" : ""}`, font: { size: 12, color: colour("soft") } });
  });
  draw(errorPlot, traces, {
    ...axes, shapes, annotations, hovermode: "x unified", height: rows * (narrow ? 150 : 165) + 46, margin: { l: 8, r: 8, t: 6, b: 4 },
    xaxis: axis({ title: label("time since the command [s]"), anchor: `y${rows > 1 ? rows : ""}`, showspikes: true, spikemode: "across", spikethickness: 1, spikedash: "solid", spikecolor: colour("faint") }),
  });
};

const markMoment = (t) => {
  const tracks = data.episodes[episode].tracks.filter(planar);
  if (!tracks.length) return;
  const first = tablePlot.data.length - curves.length, at = tracks.map((track) => nearest(track.time, t));
  const pick = (axisIndex) => curves.map((c) => tracks.map((track, i) => (t === null || !track[c.key] ? null : track[c.key][axisIndex][at[i]])));
  Plotly.restyle(tablePlot, { x: pick(0), y: pick(1) }, curves.map((_, i) => first + i));
};

const drawEpisode = () => { drawTable(); drawErrors(); };

const choose = (index, focus) => {
  episode = index;
  for (const button of document.querySelectorAll("[data-episode]")) {
    const chosen = Number(button.dataset.episode) === index;
    button.setAttribute("aria-checked", chosen);
    button.tabIndex = chosen ? 0 : -1;
    if (chosen && focus) button.focus();
  }
  drawEpisode();
};

const sample = (key) => {
  const line = { nominal: "1.5 3.5", calibrated: "6 4", with_effects: "none" }[key];
  const mark = key === "real" ? [3, 10, 17].map((x) => `<circle cx="${x}" cy="5" r="2.1" fill="var(--real)"/>`).join("")
    : `<path d="M1 5h18" stroke="var(--${key.replace("_", "-")})" stroke-width="2.4" stroke-linecap="round" stroke-dasharray="${line}"/>`;
  return `<svg width="20" height="10" viewBox="0 0 20 10" aria-hidden="true">${mark}</svg>`;
};

if (data.episodes.length) {
  const legend = document.getElementById("legend");
  for (const curve of curves) {
    const button = element("button", "", legend);
    button.type = "button";
    button.innerHTML = sample(curve.key);
    button.append(curve.label);
    button.setAttribute("aria-pressed", true);
    button.addEventListener("click", () => {
      shown[curve.key] = !shown[curve.key];
      button.setAttribute("aria-pressed", shown[curve.key]);
      drawEpisode();
    });
  }
  for (const button of document.querySelectorAll("[data-episode]")) {
    button.addEventListener("click", () => choose(Number(button.dataset.episode), false));
    button.addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      choose((episode + step + data.episodes.length) % data.episodes.length, true);
    });
  }
  choose(0, false);
  errorPlot.on("plotly_hover", (event) => markMoment(event.points[0].x));
  errorPlot.on("plotly_unhover", () => markMoment(null));
  redraws.push(drawEpisode);
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; drawEpisode(); } });
}
