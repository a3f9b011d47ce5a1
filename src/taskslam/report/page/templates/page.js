// What a script adds to a page that stands without it: sorted columns, the rounds of a waypoint, and nothing else.
(() => {
  const root = document.documentElement;
  const SVG = "http://www.w3.org/2000/svg";
  const data = JSON.parse(document.getElementById("data").textContent);
  const card = document.getElementById("card");
  const all = (selector, inside = document) => [...inside.querySelectorAll(selector)];
  const {taskUnits, length, angle} = Units;
  root.classList.add("js");

  // An element with attributes and children; text stays text.
  const make = (tag, attributes = {}, ...children) => {
    const svg = ["svg", "circle", "line", "text", "use"].includes(tag);
    const element = svg ? document.createElementNS(SVG, tag) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };

  // The filter's boxes hide things by the style sheet; the script only counts them.
  const shows = (key) => document.getElementById(`show-${key}`)?.checked ?? true;
  const boxes = all(".show.method");
  const count = () => {
    const label = document.querySelector(".how-many");
    if (label) label.textContent = `${boxes.filter((box) => box.checked).length} of ${boxes.length}`;
  };
  if (boxes.length) {
    const choose = (text, checked) => {
      const button = make("button", {type: "button"}, text);
      button.addEventListener("click", () => { for (const box of boxes) box.checked = checked; count(); });
      return button;
    };
    document.querySelector(".pick fieldset").append(make("p", {}, choose("all", true), choose("none", false)));
    count();
  }
  document.querySelector(".controls").addEventListener("change", () => { count(); if (shown) show(shown); });
  document.addEventListener("pointerdown", (event) => {
    for (const open of all(".pick[open]")) if (!open.contains(event.target)) open.open = false;
  });

  // The card: the rounds behind a cell, a panel, or a goal on the plan.
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const known = (arrivals) => arrivals.filter((arrival) => arrival[1] !== null);
  const centre = (arrivals) => [mean(arrivals.map((at) => at[1])), mean(arrivals.map((at) => at[2]))];

  const marker = (run, x, y) => make("use", {href: `#mark-${run.method}`, x, y});

  // Arrivals of some runs, ahead of the goal upwards; with one run around its mean, else around the goal.
  const plot = (runs, goal, scenario) => {
    const SIZE = 240;
    const points = runs.flatMap((run) => known(run.waypoints[goal].arrivals));
    const single = runs.length === 1 && points.length > 1;
    const [ahead, left] = single ? centre(points) : [0, 0];
    const reach = Math.max(...points.map((at) => Math.hypot(at[1] - ahead, at[2] - left)), single ? 0.001 : scenario.tolerance);
    const scale = SIZE / 2 / (1.25 * reach);
    const place = (x, y) => [SIZE / 2 - (y - left) * scale, SIZE / 2 - (x - ahead) * scale];
    const svg = make("svg", {viewBox: `0 0 ${SIZE} ${SIZE}`, class: "plot", "aria-hidden": "true"});
    const [gx, gy] = place(0, 0);
    svg.append(make("circle", {cx: gx, cy: gy, r: scenario.tolerance * scale, fill: "none", stroke: "var(--muted)", "stroke-dasharray": "3 3"}));
    svg.append(make("line", {x1: gx - 6, y1: gy, x2: gx + 6, y2: gy, stroke: "var(--ink)", "stroke-width": 1.5}));
    svg.append(make("line", {x1: gx, y1: gy + 6, x2: gx, y2: gy - 16, stroke: "var(--ink)", "stroke-width": 1.5}));
    if (single && runs[0].waypoints[goal].E !== null) {
      svg.append(make("circle", {cx: SIZE / 2, cy: SIZE / 2, r: runs[0].waypoints[goal].E * scale, fill: runs[0].colour, "fill-opacity": 0.12}));
    }
    for (const run of runs) {
      known(run.waypoints[goal].arrivals).forEach((arrival) => {
        const [x, y] = place(arrival[1], arrival[2]);
        svg.append(marker(run, x, y));
        if (single) svg.append(make("text", {x: x + 8, y: y + 4, class: "halo"}, arrival[0].replace(/^\D+/, "")));
      });
    }
    const round = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].findLast((m) => m * scale <= 90) ?? 0.001;
    svg.append(make("line", {x1: 8, y1: SIZE - 8, x2: 8 + round * scale, y2: SIZE - 8, stroke: "var(--ink)", "stroke-width": 2}));
    const label = taskUnits() ? `${Number((round / scenario.diameter).toPrecision(2))} D` : `${Number((100 * round).toPrecision(2))} cm`;
    svg.append(make("text", {x: 8, y: SIZE - 13, class: "halo"}, label));
    return points.length ? svg : make("p", {}, "No round reached it.");
  };

  const table = (heads, rows) => {
    const cells = (tag, texts) => texts.map((text) => make(tag, {}, text));
    return make("table", {}, make("thead", {}, make("tr", {}, ...cells("th", heads))),
      make("tbody", {}, ...rows.map((row) => make("tr", {}, ...cells("td", row)))));
  };

  const ofRun = (run, goal) => {
    const scenario = data.scenarios[run.scenario];
    const waypoint = run.waypoints[goal];
    const arrivals = known(waypoint.arrivals);
    const [x, y] = arrivals.length ? centre(arrivals) : [0, 0];
    const rows = waypoint.arrivals.map(([round, ahead, left, turn, bx, by]) => [
      round.replace("round ", ""),
      ahead === null || arrivals.length < 2 ? "–" : length(Math.hypot(ahead - x, left - y), scenario),
      ahead === null ? "–" : length(Math.hypot(ahead, left), scenario),
      angle(turn, scenario),
      ahead === null || bx === null ? "–" : length(Math.hypot(ahead - bx, left - by), scenario),
    ]);
    return [
      make("h4", {}, `Waypoint ${goal + 1} · ${run.name}`),
      make("p", {}, `${waypoint.unjudged ? "Not judged" : `${waypoint.visits} of ${waypoint.rounds} rounds`}; E ${length(waypoint.E, scenario)}, e ${length(waypoint.e, scenario)}, Δ ${angle(waypoint.H, scenario)}`),
      make("div", {class: "halves"}, plot([run], goal, scenario),
        table(["Round", "from mean", "from goal", "heading off", "SLAM off"], rows)),
    ];
  };

  // One row a method, one column a mode: E where every round arrived, else how many did.
  const ofGoal = (key, goal) => {
    const scenario = data.scenarios[key];
    const runs = Object.values(data.runs).filter((run) => run.scenario === key && run.waypoints[goal] && shows(run.method) && shows(run.mode));
    const modes = data.modes.filter((mode) => runs.some((run) => run.mode === mode));
    const say = ({E, visits, rounds, unjudged}) => unjudged ? "not judged" : visits === rounds && E !== null ? length(E, scenario) : `${visits}/${rounds}`;
    const rows = [...new Set(runs.map((run) => run.label))].map((label) => {
      const own = runs.filter((run) => run.label === label);
      const icon = make("svg", {viewBox: "0 0 16 16", class: "icon", "aria-hidden": "true"}, marker(own[0], 8, 8));
      const cells = modes.map((mode) => own.filter((run) => run.mode === mode).map((run) => say(run.waypoints[goal])).join(", ") || "–");
      return [make("span", {}, icon, ` ${label}`), ...cells];
    });
    return [
      make("h4", {}, `Waypoint ${goal + 1} · ${scenario.title}`),
      make("p", {}, "Every arrival of the runs that the filter shows; the goal's heading points up, the dashed circle is navigation's tolerance."),
      make("div", {class: "halves"}, plot(runs, goal, scenario), table(["E", ...modes.map((mode) => mode.replace("-", " "))], rows)),
    ];
  };

  let shown = null;
  let pinned = false;
  const show = (target) => {
    const {run, scenario, goal} = target.dataset;
    card.replaceChildren(...(run ? ofRun(data.runs[run], Number(goal)) : ofGoal(scenario, Number(goal))));
    const close = make("button", {type: "button", class: "close", "aria-label": "Close"}, "×");
    close.addEventListener("click", hide);
    card.append(close);
    card.hidden = false;
    shown = target;
    place(target);
  };
  // Beside its target, inside the window; on a phone the style sheet puts it at the bottom.
  const place = (target) => {
    const box = target.getBoundingClientRect();
    const {offsetWidth: width, offsetHeight: height} = card;
    const below = box.bottom + 8 + height <= innerHeight || box.top < height + 8;
    card.style.left = `${Math.max(8, Math.min(box.left + box.width / 2 - width / 2, innerWidth - width - 8))}px`;
    card.style.top = `${Math.max(8, Math.min(below ? box.bottom + 8 : box.top - height - 8, innerHeight - height - 8))}px`;
  };
  const hide = () => { card.hidden = true; shown = null; pinned = false; };

  for (const target of all("[data-goal]")) {
    target.addEventListener("pointerenter", (event) => { if (event.pointerType === "mouse" && !pinned) show(target); });
    target.addEventListener("pointerleave", () => { if (!pinned) hide(); });
    target.addEventListener("focus", () => { if (!pinned && target.matches(":focus-visible")) show(target); });
    target.addEventListener("blur", () => { if (!pinned) hide(); });
    target.addEventListener("click", (event) => {
      event.preventDefault();
      if (pinned && shown === target) { hide(); return; }
      show(target);
      pinned = true;
    });
  }
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });
  document.addEventListener("pointerdown", (event) => {
    if (pinned && !card.contains(event.target) && !event.target.closest("[data-goal]")) hide();
  });
  addEventListener("scroll", () => { if (!pinned) hide(); else if (shown) place(shown); }, {passive: true});

  // One tab stop a matrix; arrow keys walk inside it.
  for (const matrix of all("table.matrix")) {
    const rows = all("tr", matrix).map((row) => all("a", row)).filter((row) => row.length);
    rows.flat().forEach((link, index) => { link.tabIndex = index ? -1 : 0; });
    matrix.addEventListener("keydown", (event) => {
      const step = {ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1]}[event.key];
      const from = event.target.closest("a");
      if (!step || !from) return;
      event.preventDefault();
      const visible = rows.filter((row) => row[0].offsetParent !== null);
      const at = visible.findIndex((row) => row.includes(from));
      const row = visible[Math.max(0, Math.min(visible.length - 1, at + step[0]))];
      const next = row[Math.max(0, Math.min(row.length - 1, visible[at].indexOf(from) + step[1]))];
      from.tabIndex = -1;
      next.tabIndex = 0;
      next.focus();
    });
  }

  // Sorting: by the first number of a cell, else by its text; rows stay within their group.
  const valueOf = (cell) => {
    const text = (cell?.querySelector(".si") ?? cell)?.textContent.trim() ?? "";
    const number = Number.parseFloat(text.replace("−", "-"));
    return text === "–" || text === "" ? null : Number.isNaN(number) ? text : number;
  };
  const compare = (a, b) => {
    if (a === null || b === null) return (a === null) - (b === null);
    return typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
  };
  for (const sortable of all("table.sortable")) {
    const heads = all("thead th", sortable);
    heads.forEach((head, column) => {
      const button = make("button", {type: "button"}, ...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        for (const body of sortable.tBodies) {
          const rows = [...body.rows].filter((row) => !row.classList.contains("group"));
          rows.sort((one, other) => {
            const [a, b] = [one, other].map((row) => valueOf(row.cells[column]));
            return a === null || b === null || !down ? compare(a, b) : -compare(a, b);
          });
          body.append(...rows);
        }
      });
    });
  }

  // A link into something folded opens it; so does printing, until the paper is out.
  const reveal = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let at = target; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
    if (target) target.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  reveal();
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = all("details:not([open]):not(.pick)");
    for (const details of folded) details.open = true;
  });
  addEventListener("afterprint", () => { for (const details of folded) details.open = false; });
})();
