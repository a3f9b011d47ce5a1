"use strict";
// A tour's start and goals on its floor plan, to be moved, turned, added and taken away; the server plans and saves.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const {start, goals, view} = JSON.parse(document.getElementById("data").textContent);
  const svg = document.querySelector("svg.drawing");
  const body = document.querySelector("#goals tbody");
  const at = (id) => document.getElementById(id);
  const tour = [start, ...goals];  // [x, y, heading] each, m and rad; the first is the start
  let legs = [], startFault = "", chosen = -1, asked = 0, shown = 0;

  const make = (tag, attributes = {}, ...children) => {
    const drawn = ["g", "circle", "line", "polyline", "text"].includes(tag);
    const element = drawn ? document.createElementNS(SVG, tag) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };
  const ways = svg.appendChild(make("g", {class: "ways"}));
  const places = svg.appendChild(make("g", {class: "places"}));

  const toDrawing = ([x, y]) => [(x - view.left) * view.scale, (view.top - y) * view.scale];
  const toMap = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [view.left + point.x / view.scale, view.top - point.y / view.scale];
  };
  const rounded = (value, step) => Math.round(value / step) * step;
  const tidy = (pose) => [+pose[0].toFixed(3), +pose[1].toFixed(3), +Math.atan2(Math.sin(pose[2]), Math.cos(pose[2])).toFixed(3)];
  const degrees = (radians) => Math.round(radians * 180 / Math.PI);
  const name = (index) => index ? `goal ${index}` : "start";
  const faultOf = (index) => index ? legs[index - 1]?.fault ?? "" : startFault;

  const change = (index, pose) => { tour[index] = tidy(pose); chosen = index; draw(); survey(); };
  const take = (index) => {
    if (!index) return;
    tour.splice(index, 1); legs.splice(index - 1, 1);
    chosen = Math.min(index, tour.length - 1);
    draw(); survey();
    places.children[chosen].focus();
  };
  const add = (x, y) => {
    const [px, py, heading] = tour.at(-1);
    tour.push(tidy([x, y, x === px && y === py ? heading : Math.atan2(y - py, x - px)]));
    chosen = tour.length - 1;
    draw(); survey();
    places.children[chosen].focus();
  };
  const swap = (index, other) => {
    if (index < 1 || other < 1 || other >= tour.length) return;
    [tour[index], tour[other]] = [tour[other], tour[index]];
    chosen = other;
    draw(); survey();
  };

  // Asks what the robot would do; the newest answer counts.
  const ask = async (what) => {
    const answer = await fetch(what, {
      method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify({start: tour[0], goals: tour.slice(1)}),
    });
    return answer.json();
  };
  const survey = async () => {
    const number = ++asked;
    try {
      const answer = await ask("survey");
      if (number < asked) return;
      if (answer.error) { at("verdict").textContent = answer.error; return; }
      legs = answer.legs; startFault = answer.start_fault;
      const faults = answer.faults;
      at("verdict").textContent = faults.length ? "This tour cannot be driven as it is." :
        tour.length > 1 ? `Every goal can be reached: ${answer.length_m.toFixed(1)} m of way a round.` : "No goal yet.";
      at("faults").replaceChildren(...faults.map((fault) => make("li", {}, fault)));
      draw();
      document.documentElement.dataset.surveyed = String(++shown);
    } catch (error) {
      at("verdict").textContent = `The editor's program does not answer: ${error.message}`;
    }
  };
  const save = async () => {
    const answer = await ask("save").catch((error) => ({error: `The editor's program does not answer: ${error.message}`}));
    at("said").textContent = answer.error ?? `Saved ${answer.saved}`;
  };

  const dragging = (element, moved, done) => {
    element.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      element.setPointerCapture?.(event.pointerId);
      const move = (next) => moved(toMap(next));
      const end = () => { element.removeEventListener("pointermove", move); element.removeEventListener("pointerup", end); done(); };
      element.addEventListener("pointermove", move);
      element.addEventListener("pointerup", end);
    });
  };

  const drawPlace = (pose, index) => {
    const group = make("g", {
      tabindex: 0, role: "button", class: `place${index === chosen ? " chosen" : ""}${faultOf(index) ? " faulty" : ""}`,
      "aria-label": `${name(index)}, x ${pose[0]} m, y ${pose[1]} m, heading ${degrees(pose[2])} degrees${faultOf(index) ? ", cannot be driven to" : ""}`,
    });
    const put = () => {
      const [x, y] = toDrawing(tour[index]), heading = tour[index][2];
      const [tx, ty] = [x + 27 * Math.cos(heading), y - 27 * Math.sin(heading)];
      const text = make("text", {x, y: y + 4.3, "text-anchor": "middle"}, index ? String(index) : "S");
      const disc = make("circle", {cx: x, cy: y, r: 12});
      const handle = make("circle", {cx: tx, cy: ty, r: 6, class: "handle"});
      group.replaceChildren(make("line", {x1: x, y1: y, x2: tx, y2: ty}), disc, text, handle);
      dragging(disc, ([mx, my]) => { tour[index] = tidy([rounded(mx, 0.01), rounded(my, 0.01), tour[index][2]]); move(); }, ended);
      dragging(text, ([mx, my]) => { tour[index] = tidy([rounded(mx, 0.01), rounded(my, 0.01), tour[index][2]]); move(); }, ended);
      dragging(handle, ([mx, my]) => {
        tour[index][2] = rounded(Math.atan2(my - tour[index][1], mx - tour[index][0]), Math.PI / 36);
        move();
      }, ended);
    };
    // While it is dragged its parts stay in the page, or the pointer would lose them.
    const move = () => {
      const [x, y] = toDrawing(tour[index]), heading = tour[index][2];
      const [line, disc, text, handle] = group.children;
      const [tx, ty] = [x + 27 * Math.cos(heading), y - 27 * Math.sin(heading)];
      for (const [key, value] of Object.entries({x1: x, y1: y, x2: tx, y2: ty})) line.setAttribute(key, value);
      disc.setAttribute("cx", x); disc.setAttribute("cy", y);
      text.setAttribute("x", x); text.setAttribute("y", y + 4.3);
      handle.setAttribute("cx", tx); handle.setAttribute("cy", ty);
    };
    const ended = () => change(index, tour[index]);
    group.addEventListener("keydown", (event) => {
      const [x, y, heading] = tour[index];
      const step = {ArrowLeft: [-0.05, 0], ArrowRight: [0.05, 0], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05]}[event.key];
      const turn = {"[": Math.PI / 36, "]": -Math.PI / 36}[event.key];
      if (step) change(index, [x + step[0], y + step[1], heading]);
      else if (turn) change(index, [x, y, heading + turn]);
      else if (event.key === "Delete" || event.key === "Backspace") { event.preventDefault(); take(index); return; }
      else return;
      event.preventDefault();
      places.children[index].focus();
    });
    put();
    return group;
  };

  const input = (index, part, value, step) => {
    const field = make("input", {type: "number", step, value, "aria-label": `${["x", "y", "heading"][part]} of ${name(index)}`});
    field.addEventListener("change", () => {
      const typed = Number(field.value);
      if (field.value === "" || !Number.isFinite(typed)) { field.value = value; return; }
      change(index, tour[index].map((old, k) => k !== part ? old : part === 2 ? typed * Math.PI / 180 : typed));
    });
    return make("td", {}, field);
  };
  const button = (text, label, act) => {
    const made = make("button", {type: "button", "aria-label": label}, text);
    made.addEventListener("click", act);
    return made;
  };
  const cm = (metres) => metres === null || metres === undefined ? "–" : (100 * metres).toFixed(0);
  const row = ([x, y, heading], index) => {
    const leg = index ? legs[index - 1] : undefined;
    const acts = index ? [
      button("↑", `${name(index)} earlier`, () => swap(index, index - 1)),
      button("↓", `${name(index)} later`, () => swap(index, index + 1)),
      button("✕", `take ${name(index)} away`, () => take(index)),
    ] : [];
    return make("tr", {class: faultOf(index) ? "faulty" : ""},
      make("td", {}, index ? String(index) : "start"), input(index, 0, x, 0.05), input(index, 1, y, 0.05),
      input(index, 2, degrees(heading), 5), make("td", {}, leg?.length_m == null ? "–" : leg.length_m.toFixed(1)),
      make("td", {}, cm(leg?.clearance_m)), make("td", {}, cm(leg?.narrowest_m)), make("td", {class: "acts"}, ...acts));
  };

  const draw = () => {
    const focused = places.contains(document.activeElement) ? [...places.children].indexOf(document.activeElement) : -1;
    ways.replaceChildren(...legs.filter((leg) => leg.path).map((leg) =>
      make("polyline", {points: leg.path.map((point) => toDrawing(point).map((v) => v.toFixed(1)).join()).join(" ")})));
    places.replaceChildren(...tour.map(drawPlace));
    body.replaceChildren(...tour.map(row));
    if (focused >= 0) places.children[Math.min(focused, tour.length - 1)].focus();
  };

  svg.addEventListener("pointerdown", (event) => { if (!event.button) add(...toMap(event).map((v) => rounded(v, 0.01))); });
  at("add").addEventListener("click", () => {
    const [x, y, heading] = tour.at(-1);
    add(x + Math.cos(heading), y + Math.sin(heading));
  });
  at("save").addEventListener("click", save);
  draw();
  survey();
})();
