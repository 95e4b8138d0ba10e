// The chosen episode: trajectories in the plane, signals and errors over time, and one moment marked in all.
const tablePlot = document.getElementById("table-plot");
const signalPlot = document.getElementById("signal-plot");
const errorPlot = document.getElementById("error-plot");
const curves = [{ key: "real", label: "recorded" }, ...data.models];
const shown = Object.fromEntries(curves.map((curve) => [curve.key, true]));
let episode = 0;

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

// One panel under the other on one time axis; the last has its numbers.
const timeAxis = (rows) => axis({ title: label(`time since ${data.began} [s]`), anchor: `y${rows > 1 ? rows : ""}`, showspikes: true, spikemode: "across", spikethickness: 1, spikedash: "solid", spikecolor: colour("faint") });
const span = (tracks) => {
  const times = tracks.map((track) => track.time).filter((time) => time.length);
  return [Math.min(...times.map((time) => time[0])), Math.max(...times.map((time) => time[time.length - 1]))];
};
const panelDomain = (i, rows, gap) => [1 - (i + 1) / rows + (i < rows - 1 ? gap : 0), 1 - i / rows - gap];
const panelTitle = (content, i, rows, gap) => ({ xref: "paper", x: 0, yref: "paper", y: 1 - i / rows - gap, yanchor: "bottom", xanchor: "left", showarrow: false, text: content, font: { size: 12, color: colour("soft") } });

const signalsOf = (chosen) => chosen.tracks.filter((track) => !planar(track)).flatMap((track) => track.columns.map((column, k) => ({ ...column, k, track })));
const withUnit = ({ name, unit }) => text(unit ? `${name} [${unit}]` : name);

const signalTrace = ({ track, k, unit }, curve, n) => {
  const real = curve.key === "real", style = STYLE[curve.key];
  return {
    x: track.time, y: track[curve.key][k], yaxis: `y${n}`, type: "scatter", mode: real ? "markers" : "lines", name: curve.label,
    marker: { size: 4.5, color: faded("real", 0.3) }, line: { color: colour(curve.key), width: style.width, dash: style.dash },
    hovertemplate: `%{y:.4f} ${text(unit)} ${curve.label}<extra></extra>`,
  };
};

const drawSignals = () => {
  const signals = signalsOf(data.episodes[episode]), rows = signals.length, narrow = signalPlot.clientWidth < 480;
  signalPlot.hidden = !rows;
  if (!rows) return;
  const visible = curves.filter((curve) => shown[curve.key]), gap = 0.16 / rows, axes = {};
  const traces = signals.flatMap((signal, i) => visible.filter((c) => signal.track[c.key]).map((c) => signalTrace(signal, c, i ? i + 1 : "")));
  signals.forEach((_, i) => { axes[`yaxis${i ? i + 1 : ""}`] = axis({ domain: panelDomain(i, rows, gap), nticks: 5 }); });
  draw(signalPlot, traces, {
    ...axes, annotations: signals.map((signal, i) => panelTitle(withUnit(signal), i, rows, gap)), shapes: [], hovermode: "x unified",
    height: rows * (narrow ? 105 : 118) + 46, margin: { l: 8, r: 8, t: 6, b: 4 }, xaxis: { ...timeAxis(rows), range: span(signals.map(({ track }) => track)) },
  });
};

// Thousandths of the unit; far below the noise nothing is worth a look, and a logarithm needs an end.
const LOWEST = 0.02;

const drawErrors = () => {
  const tracks = data.episodes[episode].tracks, rows = tracks.length, narrow = errorPlot.clientWidth < 480;
  const traces = [], shapes = [], annotations = [], axes = {};
  const top = Math.max(...tracks.flatMap((t) => data.models.flatMap((m) => t.error_mm[m.key] || [0])).filter((v) => v !== null), ...tracks.map((t) => t.floor_mm || 0), 1);
  tracks.forEach((track, i) => {
    const n = i ? i + 1 : "", gap = 0.09 / rows, unit = text(track.error_unit);
    axes[`yaxis${n}`] = axis({
      type: "log", range: [Math.log10(LOWEST), Math.log10(top) + 0.15], domain: panelDomain(i, rows, gap),
      title: label(unit), tickvals: [0.1, 1, 10, 100, 1000], ticktext: ["0.1", "1", "10", "100", "1000"],
    });
    for (const model of data.models.filter((m) => shown[m.key] && track.error_mm[m.key])) {
      const style = STYLE[model.key];
      traces.push({
        x: track.time, y: track.error_mm[model.key].map((e) => (e === null ? null : Math.max(e, LOWEST))), yaxis: `y${n}`, type: "scatter", mode: "lines", name: model.label,
        line: { color: colour(model.key), width: style.width - 0.3, dash: style.dash }, hovertemplate: `%{y:.2f} ${unit} ${model.label}<extra></extra>`,
      });
    }
    if (track.floor_mm) shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, yref: `y${n}`, y0: track.floor_mm, y1: track.floor_mm, line: { color: colour("faint"), ...NOISE } });
    annotations.push(panelTitle(`${text(track.object)}: distance to the recording`, i, rows, gap));
  });
  draw(errorPlot, traces, {
    ...axes, shapes, annotations, hovermode: "x unified", height: rows * (narrow ? 150 : 165) + 46, margin: { l: 8, r: 8, t: 6, b: 4 },
    xaxis: { ...timeAxis(rows), range: span(tracks) },
  });
};

const markMoment = (t) => {
  if (!signalPlot.hidden) Plotly.relayout(signalPlot, { shapes: t === null ? [] : [{ type: "line", yref: "paper", x0: t, x1: t, y0: 0, y1: 1, line: { color: colour("faint"), width: 1 } }] });
  const tracks = data.episodes[episode].tracks.filter(planar);
  if (!tracks.length) return;
  const first = tablePlot.data.length - curves.length, at = tracks.map((track) => nearest(track.time, t));
  const pick = (axisIndex) => curves.map((c) => tracks.map((track, i) => (t === null || !track[c.key] ? null : track[c.key][axisIndex][at[i]])));
  Plotly.restyle(tablePlot, { x: pick(0), y: pick(1) }, curves.map((_, i) => first + i));
};

const drawEpisode = () => { drawTable(); drawSignals(); drawErrors(); };

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
  const line = { nominal: "1.5 3.5", calibrated: "6 4", with_effects: "none", faint: "0.1 4" }[key];
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
  if (data.episodes.some((e) => e.tracks.some((track) => track.floor_mm))) {
    const noise = element("span", "", legend);
    noise.innerHTML = sample("faint");
    noise.append("noise floor");
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
