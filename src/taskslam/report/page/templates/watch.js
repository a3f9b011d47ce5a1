"use strict";
// A folder of runs while it fills: asks its program every two seconds, and shows what it answers.
(() => {
  const SVG = "http://www.w3.org/2000/svg", EVERY = 2000, ROBOT = 0.18;  // ms; m, radius as drawn
  const WORDS = {c: "every goal reached", m: "a goal missed", u: "under way", i: "interrupted", n: "could not be driven", w: "waiting"};
  const SIGNS = {c: "✓", m: "✗", i: "…", n: "!"};
  const at = (id) => document.getElementById(id);
  let known = "", runs = [], cells = [], chosen = null, drawn = null, view = null, seen = null, looks = 0;

  const make = (tag, attributes = {}, ...children) => {
    const inDrawing = ["g", "circle", "line", "polyline", "text"].includes(tag);
    const element = inDrawing ? document.createElementNS(SVG, tag) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };
  const ask = async (what, question) => {
    const answer = await fetch(what, {method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify(question)});
    const said = await answer.json();
    if (said.error) throw new Error(said.error);
    return said;
  };
  const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

  // The matrix: modes below one another, methods by places, a box a run.
  const buildMatrix = () => {
    cells = runs.map(([place, way, mode, seed], number) => {
      const cell = make("button", {type: "button", class: "cell w", "aria-pressed": "false"});
      cell.addEventListener("click", () => { chosen = number; look(); });
      return cell;
    });
    const modes = [...new Set(runs.map((run) => run[2]))];
    at("matrix").replaceChildren(...modes.flatMap((mode) => {
      const own = runs.map((run, number) => [...run, number]).filter((run) => run[2] === mode);
      const places = [...new Set(own.map((run) => run[0]))], ways = [...new Set(own.map((run) => run[1]))];
      const boxes = (place, way) => own.filter((run) => run[0] === place && run[1] === way).sort((a, b) => a[3] - b[3]).map((run) => cells[run[4]]);
      const rows = ways.map((way) => make("tr", {}, make("th", {scope: "row"}, way),
        ...places.map((place) => make("td", {}, make("span", {class: "cells"}, ...boxes(place, way))))));
      const head = make("tr", {}, make("th", {}, "method"), ...places.map((place) => make("th", {scope: "col"}, place)));
      return [make("h3", {}, mode), make("div", {class: "scroll"}, make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows)))];
    }));
  };
  const fillMatrix = (states, done, why, shown) => cells.forEach((cell, number) => {
    const state = states[number], share = done[number] ?? 0, [place, way, mode, seed] = runs[number];
    cell.className = `cell ${state}`;
    cell.style.setProperty("--done", `${100 * share}%`);
    put(cell, SIGNS[state] ?? "");
    const progress = state === "u" || state === "i" ? `, ${Math.floor(100 * share)} % of its goals` : "";
    cell.title = `${place} · ${way} · ${mode} · seed ${seed}: ${WORDS[state]}${progress}${why[number] ? `. ${why[number]}` : ""}`;
    cell.setAttribute("aria-label", cell.title);
    cell.setAttribute("aria-pressed", String(number === shown));
  });

  // One run on its plan.
  const on = ([x, y]) => [(x - view.left) * view.scale, (view.top - y) * view.scale];
  const disc = (kind, [x, y, heading], radius) => {
    const [cx, cy] = on([x, y]);
    return [make("circle", {class: kind, cx, cy, r: radius}),
      make("line", {class: kind, x1: cx, y1: cy, x2: cx + radius * Math.cos(heading), y2: cy - radius * Math.sin(heading)})];
  };
  const drawGoal = ([x, y, heading], number, run, larger) => {
    const [cx, cy] = on([x, y]), tip = [cx + 21 * larger * Math.cos(heading), cy - 21 * larger * Math.sin(heading)];
    const how = run.failed.includes(number) ? "failed" : run.reached.includes(number) ? "reached" : number === run.heading ? "next" : "";
    return make("g", {class: `goal ${how}`}, make("line", {x1: cx, y1: cy, x2: tip[0], y2: tip[1]}), make("circle", {cx, cy, r: 11 * larger}),
      make("text", {x: cx, y: cy + 4.3 * larger, "font-size": 12 * larger, "text-anchor": "middle"}, String(number + 1)));
  };
  const drawRun = (run) => {
    const drawing = seen.ownerSVGElement, parts = [], {newest} = run;
    const larger = Math.min(2, Math.max(1, drawing.viewBox.baseVal.width / drawing.clientWidth / 1.4));  // where it is shown small
    const radius = Math.max(8 * larger, ROBOT * view.scale);
    const line = (points) => points.map((point) => on(point).map((v) => v.toFixed(1)).join()).join(" ");
    if (newest?.way.length) parts.push(make("polyline", {class: "way", points: line(newest.way)}));
    parts.push(...run.goals.map((goal, number) => drawGoal(goal, number, run, larger)));
    if (newest) parts.push(...newest.scan.map((point) => { const [cx, cy] = on(point); return make("circle", {class: "hit", cx, cy, r: 2.2 * larger}); }));
    if (newest?.truth) parts.push(...disc("truth", newest.truth, radius));
    if (newest?.estimate) parts.push(...disc("belief", newest.estimate, radius + 3));
    seen.replaceChildren(...parts);
  };
  const showPlan = async (number) => {
    const {drawing, view: its, whole} = await ask("plan", {known, run: number});
    at("plan").replaceChildren();
    seen = null;
    if (drawing === null) at("plan").append(make("p", {class: "none"}, "Nothing of this run can be drawn."));
    else {
      at("plan").innerHTML = drawing;  // of our own program, from its own templates
      view = its;
      seen = at("plan").querySelector("svg.drawing").appendChild(make("g", {class: "seen"}));
    }
    drawn = whole ? number : null;  // a run that has just begun has no plan yet: it is asked for again
  };
  const showRun = async (run, number) => {
    at("run").hidden = !run;
    if (!run) return;
    put(at("run-title"), run.title); put(at("run-setting"), run.setting); put(at("run-where"), run.where);
    at("follow").hidden = chosen === null;
    at("happened").replaceChildren(...run.happened.map(({when, kind, what}) =>
      make("li", {class: kind}, make("span", {class: "when"}, when), make("span", {}, what))));
    if (!run.happened.length) at("happened").append(make("li", {}, make("span", {class: "when"}, "–"), make("span", {}, "nothing yet")));
    if (drawn !== number) await showPlan(number);
    if (seen) drawRun(run);
  };

  let busy = false;
  const look = async () => {
    if (busy) return;
    busy = true;
    try {
      const said = await ask("look", {known, run: chosen});
      if (said.runs) {
        const kept = chosen === null ? "" : JSON.stringify(runs[chosen]);
        runs = said.runs; known = said.known; drawn = null;
        const place = runs.findIndex((run) => JSON.stringify(run) === kept);
        chosen = place < 0 ? null : place;  // shown again by the next look
        buildMatrix();
      }
      fillMatrix(said.states, said.done, said.why, said.chosen);
      put(at("counts"), said.counts); put(at("outlook"), said.outlook);
      await showRun(said.run, said.chosen);
      at("trouble").hidden = true;
      document.documentElement.dataset.looks = String(++looks);
    } catch (error) {
      at("trouble").hidden = false;
      put(at("trouble"), `What is here may be old: ${error.message}`);
    } finally {
      busy = false;
    }
  };
  at("follow").addEventListener("click", () => { chosen = null; look(); });
  setInterval(look, EVERY);
  look();
})();
