// Asks for the state every two seconds; shows the report as often as it is written anew.
(() => {
"use strict";
const at = (id) => document.getElementById(id);
let shown = null, ended = false, frame = null;
const tell = (state) => {
  ended = state.ended;
  at("state").textContent = state.stage;
  at("bar").style.width = `${100 * (state.done ?? 0)}%`;
  at("bar").parentNode.hidden = state.done === null;
  const parts = [];
  if (state.done !== null) parts.push(`${Math.floor(100 * state.done)} %`);
  if (state.gap !== null) parts.push(`gap ${state.gap.toPrecision(3)}`);
  if (state.elapsed_s !== null) parts.push(`${Math.round(state.elapsed_s)} s`);
  at("numbers").textContent = parts.join(" · ");
  if (state.report === null || state.report === shown) return;
  shown = state.report;
  at("known").textContent = ended || state.done === null ? "" : "What is known so far:";
  at("empty").hidden = true;
  const next = document.createElement("iframe");
  next.setAttribute("sandbox", "allow-scripts allow-downloads");
  next.title = "report";
  next.src = `report.html?${shown}`;
  if (frame) frame.replaceWith(next); else document.body.append(next);
  frame = next;
};
const ask = async () => {
  try {
    const answer = await fetch("state.json");
    if (!answer.ok) throw new Error(answer.status);
    tell(await answer.json());
  } catch {
    at("state").textContent = ended ? "done; this page is no longer served" : "no answer: it has stopped";
    if (ended) return;
  }
  setTimeout(ask, ended ? 10000 : 2000);
};
ask();
})();
