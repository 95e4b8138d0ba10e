// What all figures share: colours from the page's style, an axis, a plot that follows the theme.
const data = JSON.parse(document.getElementById("data").textContent);
const coarse = matchMedia("(pointer: coarse)").matches;
const redraws = [];

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name.replaceAll("_", "-")}`).trim();
const faded = (name, share) => {
  const value = parseInt(colour(name).slice(1), 16);
  return `rgba(${value >> 16}, ${(value >> 8) & 255}, ${value & 255}, ${share})`;
};

// Plotly reads a little HTML in its labels; names from a bag are text.
const text = (name) => String(name).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");

const element = (tag, className, parent, content) => {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (content !== undefined) made.textContent = content;
  if (parent) parent.append(made);
  return made;
};

const nameInto = (parent, name) => {
  const at = name.indexOf("@");
  const span = element("span", "name", parent);
  element("b", "", span, at < 0 ? name : name.slice(0, at));
  if (at >= 0) element("span", "tail", span, name.slice(at));
  span.title = name;
};

const axis = (more) => ({
  color: colour("faint"), gridcolor: colour("grid"), linecolor: colour("line"), zeroline: false, ticks: "",
  tickfont: { size: 11 }, title: { font: { size: 11.5 }, standoff: 6 }, fixedrange: coarse, automargin: true, ...more,
});

const label = (content) => ({ text: content, font: { size: 11.5 }, standoff: 6 });

const layout = (more) => ({
  paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", showlegend: false, autosize: true,
  dragmode: coarse ? false : "zoom", margin: { l: 8, r: 8, t: 8, b: 8 },
  font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: colour("soft") },
  modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("faint"), activecolor: colour("ink") },
  hoverlabel: { bgcolor: colour("surface"), bordercolor: colour("line"), font: { color: colour("ink"), size: 12 } },
  ...more,
});

const config = {
  responsive: true, displaylogo: false, displayModeBar: coarse ? false : "hover", doubleClick: "reset",
  modeBarButtons: [["toImage", "resetScale2d"]], toImageButtonOptions: { format: "svg", filename: "compass" },
};

const draw = (target, traces, shape) => Plotly.react(target, traces, layout(shape), config);

// Figures below the fold are drawn when they come near the screen.
const whenSeen = (target, paint) => {
  let seen = false;
  const watch = new IntersectionObserver((entries) => {
    if (seen || !entries.some((entry) => entry.isIntersecting)) return;
    seen = true;
    watch.disconnect();
    paint();
  }, { rootMargin: "400px" });
  watch.observe(target);
  redraws.push(() => seen && paint());
};

// A track without columns is a place in the plane; one with columns is a signal over time.
const planar = (track) => !track.columns.length;

const NOISE = { width: 1.6, dash: "1.6px,3px" };
const STYLE = {
  real: { width: 0, dash: "solid" },
  nominal: { width: 1.6, dash: "dot" },
  calibrated: { width: 1.9, dash: "dash" },
  with_effects: { width: 2, dash: "solid" },
};

const tableBox = () => data.scene.shapes.filter((s) => s.role === "table").map(({ centre: [x, y], size: [w, h] }) => [x - w / 2, x + w / 2, y - h / 2, y + h / 2])[0];

// A circle as a path, cut where the table ends.
const circlePath = ([x, y], radius) => {
  const [x0, x1, y0, y1] = tableBox() || [-Infinity, Infinity, -Infinity, Infinity];
  const points = Array.from({ length: 97 }, (_, i) => [x + radius * Math.cos((i * Math.PI) / 48), y + radius * Math.sin((i * Math.PI) / 48)]);
  return `M${points.map(([a, b]) => `${Math.min(Math.max(a, x0), x1)},${Math.min(Math.max(b, y0), y1)}`).join("L")}Z`;
};

const sceneShapes = () => data.scene.shapes.map((shape) => {
  const [x, y] = shape.centre, [w, h] = shape.size.map((s) => s / 2);
  const fill = { table: colour("surface"), obstacle: faded("ink", 0.22), goal: faded("ink", 0.05) }[shape.role];
  if (shape.kind === "circle") return { type: "path", layer: "below", path: circlePath(shape.centre, w), fillcolor: fill, line: { width: 0 } };
  return {
    type: "rect", layer: "below", x0: x - w, x1: x + w, y0: y - h, y1: y + h,
    fillcolor: fill, line: { width: shape.role === "table" ? 1.2 : 0, color: colour("faint") },
  };
});

// An area that is not a thing says what it is.
const sceneMarks = () => data.scene.shapes.filter((shape) => shape.role === "goal").map((shape) => ({
  x: shape.centre[0], y: shape.centre[1], showarrow: false, text: "goal", font: { size: 11, color: colour("faint") },
}));

// What every drawing on the table shows: the table and all recorded motion, with a small margin.
const extent = () => {
  const box = [...(tableBox() || [Infinity, -Infinity, Infinity, -Infinity])];
  for (const track of data.episodes.flatMap((e) => e.tracks).filter(planar)) {
    track.real[0].forEach((x, i) => {
      const y = track.real[1][i];
      if (x === null || y === null) return;
      box.splice(0, 4, Math.min(box[0], x), Math.max(box[1], x), Math.min(box[2], y), Math.max(box[3], y));
    });
  }
  const margin = 0.02 * Math.max(box[1] - box[0], box[3] - box[2]);
  return [box[0] - margin, box[1] + margin, box[2] - margin, box[3] + margin];
};

const tableAxes = ([x0, x1, y0, y1]) => ({
  xaxis: axis({ range: [x0, x1], title: label(`${data.axes[0]} [m]`), constrain: "domain", showgrid: false, nticks: 8 }),
  yaxis: axis({ range: [y0, y1], title: label(`${data.axes[1]} [m]`), scaleanchor: "x", constrain: "domain", showgrid: false, nticks: 6 }),
  margin: { l: 8, r: 8, t: 4, b: 4 },
});

// Height that leaves no empty band around a drawing of equal scales; `beside` is the width of what stands next to it.
const tableHeight = (target, [x0, x1, y0, y1], beside) => Math.min(((target.clientWidth - 52 - beside) * (y1 - y0)) / (x1 - x0) + 48, 560);
