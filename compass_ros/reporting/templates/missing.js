// Where the difference sits: a map of the table before and after the effects, on one scale.
const maps = [["before", "Left over by the calibrated simulator"], ["after", "Left over with the effects"]].filter(([key]) => data.maps[key]);

const regionShapes = () => {
  if (!data.region) return [];
  const [x, y] = data.region.centre, r = data.region.radius;
  return [{ type: "circle", x0: x - r, x1: x + r, y0: y - r, y1: y + r, line: { color: colour("bad"), width: 1.8, dash: "dash" } }];
};

const drawMap = (target, map) => {
  const box = extent(), all = maps.flatMap(([key]) => data.maps[key].value.flat()).filter((v) => v !== null);
  draw(target, [{
    type: "heatmap", x: map.x, y: map.y, z: map.value, zmin: Math.min(0, ...all), zmax: Math.max(...all), hoverongaps: false, xgap: 1, ygap: 1,
    colorscale: [[0, faded("heat", 0.1)], [1, colour("heat")]],
    hovertemplate: `%{z:.2f} ${text(map.unit)}<br>(%{x:.2f}, %{y:.2f}) m<extra></extra>`,
    colorbar: { thickness: 8, outlinewidth: 0, tickfont: { size: 11, color: colour("faint") }, title: { text: text(map.unit), font: { size: 11 } }, len: 1 },
  }], {
    ...tableAxes(box), height: tableHeight(target, box, 56), shapes: [...sceneShapes().filter((s) => s.line.width), ...regionShapes()],
  });
};

for (const [key, title] of maps) {
  const box = element("div", "", document.getElementById("maps"));
  element("h3", "", box, title);
  element("p", "aside", box, `${data.maps[key].label} [${data.maps[key].unit}]${data.region ? "; the dashed circle is where it sits" : ""}`);
  const target = element("div", "plot", box);
  whenSeen(target, () => drawMap(target, data.maps[key]));
}
