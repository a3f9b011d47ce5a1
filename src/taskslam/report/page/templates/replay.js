// Plays the tours that replay.py wrote: a slider through a round, by pointer and by keyboard.
(() => {
  const FRAME_MS = 1000 / 30;
  const WAY_S = 25;  // how much of the way lies behind the robot
  const MAP_STEP_S = 1;  // between two scans that are laid into the map
  const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const VALUE = Object.fromEntries([...LETTERS].map((letter, index) => [letter, index]));

  // [[first, count, code], ...] to one pose a sample, null where none is known: the inverse of `coded` in replay.py.
  const decode = (stretches, samples, step) => {
    const poses = new Array(samples).fill(null);
    for (const [first, count, code] of stretches) {
      let place = 0;
      const number = () => {
        let [value, shift, digit] = [0, 0, 32];
        while (digit & 32) { digit = VALUE[code[place++]]; value |= (digit & 31) << shift; shift += 5; }
        return value & 1 ? -(value + 1) / 2 : value / 2;
      };
      const speed = [0, 0, 0], at = [0, 0, 0];
      for (let index = 0; index < count; index++) {
        for (let axis = 0; axis < 3; axis++) { speed[axis] += number(); at[axis] += speed[axis]; }
        poses[first + index] = [at[0] * step, at[1] * step, at[2] * step];
      }
    }
    return poses;
  };

  const between = (poses, place) => {
    const before = Math.min(Math.floor(place), poses.length - 1);
    const [a, b, share] = [poses[before], poses[before + 1], place - before];
    if (!a || !b || share < 1e-9) return a ?? null;
    return a.map((value, axis) => value + share * (b[axis] - value));
  };

  const clock = (seconds) => {
    const whole = Math.floor(seconds + 1e-6);
    return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
  };

  class Player {
    constructor(element) {
      const find = (selector) => element.querySelector(selector);
      this.facts = JSON.parse(find("script").textContent);
      [this.button, this.slider, this.said, this.time] = [".play", ".time", ".said-now", ".clock"].map(find);
      [this.round, this.speed, this.scan, this.map] = [".which", ".speed", ".scan", ".laid"].map(find);
      this.marks = find(".marks");
      this.drawing = new TourDrawing(find("canvas"), this.facts, () => { this.laid = null; this.show(); });
      this.playing = false;
      this.choose(0);
      this.button.addEventListener("click", () => this.play(!this.playing));
      this.slider.addEventListener("input", () => { this.at = Number(this.slider.value); this.show(); });
      this.round.addEventListener("change", () => this.choose(Number(this.round.value)));
      for (const box of [this.scan, this.map]) box?.addEventListener("change", () => this.show());
      document.querySelector(".controls")?.addEventListener("change", () => this.show());
      element.addEventListener("keydown", (event) => this.key(event));
      new ResizeObserver(() => this.show()).observe(find("canvas"));
    }

    // Begin with a round, decoded when it is first asked for.
    choose(index) {
      const {rate, step, rounds} = this.facts;
      const round = rounds[index];
      round.poses ??= {truth: decode(round.truth, round.count, step), estimate: decode(round.estimate, round.count, step)};
      this.now = round;
      this.at = 0;
      this.laid = null;
      this.round.value = String(index);
      this.slider.max = String((round.count - 1) / rate);
      this.marks.replaceChildren(...round.events.filter(([, kind]) => kind !== "goal").map(([at, kind, goal, words]) => {
        const mark = document.createElement("i");
        mark.className = kind;
        mark.style.left = `${100 * at / Math.max(this.end, 1e-9)}%`;
        mark.title = [clock(at), goal === null ? "" : `waypoint ${goal}`, words].filter(Boolean).join(", ");
        return mark;
      }));
      this.show();
    }

    get end() { return Number(this.slider.max); }

    seek(seconds) { this.at = Math.min(Math.max(seconds, 0), this.end); this.show(); }

    key(event) {
      if (event.target.matches("select") || event.altKey || event.ctrlKey || event.metaKey) return;
      const step = event.shiftKey ? 10 : 1;
      const to = {ArrowLeft: this.at - step, ArrowRight: this.at + step, Home: 0, End: this.end}[event.key];
      if (event.key === " " && !event.target.matches("button, input[type=checkbox]")) this.play(!this.playing);
      else if (to !== undefined) this.seek(to);
      else return;
      event.preventDefault();
    }

    play(on) {
      this.playing = on;
      this.button.textContent = on ? "Pause" : "Play";
      if (!on) { this.show(); return; }
      if (this.at >= this.end) this.at = 0;
      let last = performance.now();
      const frame = (now) => {
        if (!this.playing) return;
        if (now - last >= FRAME_MS - 2) {
          this.at = Math.min(this.at + Math.max(0, now - last) / 1000 * Number(this.speed.value), this.end);
          last = now;
          if (this.at >= this.end) { this.play(false); return; }
          this.show();
        }
        requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    }

    // Scans laid one beside the other where SLAM put the robot, from the round's beginning until now.
    laidUntil(place) {
      const {rate} = this.facts;
      const {truth, estimate} = this.now.poses;
      const stride = Math.max(1, Math.round(MAP_STEP_S * rate));
      if (!this.laid || this.laid.next > place + stride) this.laid = {next: 0, points: []};
      for (; this.laid.next <= place; this.laid.next += stride) {
        const points = this.drawing.cast(truth[this.laid.next], estimate[this.laid.next]);
        if (points) for (const value of points) this.laid.points.push(value);
      }
      return this.laid.points;
    }

    // What the moment is about: the last goal set, and how it ended if it has.
    story() {
      const past = this.now.events.filter(([at]) => at <= this.at + 1e-6);
      const goal = past.findLast(([, kind]) => kind === "goal");
      const ending = past.findLast(([, kind]) => kind === "arrival" || kind === "failure");
      const ended = goal && ending && ending[2] === goal[2] && ending[0] >= goal[0];
      const target = goal && !ended ? goal[2] - 1 : null;
      const text = !goal ? "stands at the start"
        : !ended ? `drives to waypoint ${goal[2]}`
        : ending[1] === "failure" ? `waypoint ${goal[2]} failed: ${ending[3]}` : `stands at waypoint ${goal[2]}`;
      const failures = past.filter(([, kind, , , x]) => kind === "failure" && x !== null).map((event) => [event[4], event[5]]);
      return {target, text, failures, failed: Boolean(ended && ending[1] === "failure")};
    }

    show() {
      const {rate} = this.facts;
      const {truth: truths, estimate: estimates} = this.now.poses;
      const place = this.at * rate;
      const [truth, estimate] = [between(truths, place), between(estimates, place)];
      const {target, text, failures, failed} = this.story();
      const behind = (poses, head) => [...poses.slice(Math.max(0, Math.floor(place - WAY_S * rate)), Math.floor(place) + 1), head];
      this.drawing.draw({
        truth, estimate, target, failures,
        ways: {truth: behind(truths, truth), estimate: behind(estimates, estimate)},
        scan: this.scan?.checked ? this.drawing.cast(truth, estimate) : null,
        map: this.map?.checked ? this.laidUntil(Math.floor(place)) : null,
      });
      let off = "";
      if (truth && estimate) {
        const turn = Math.atan2(Math.sin(truth[2] - estimate[2]), Math.cos(truth[2] - estimate[2]));
        const away = Math.hypot(truth[0] - estimate[0], truth[1] - estimate[1]);
        off = ` · SLAM ${Units.length(away, this.facts)} and ${Units.angle(turn, this.facts)} off`;
      } else if (truth) off = " · no estimate";
      this.said.textContent = `${text[0].toUpperCase()}${text.slice(1)}${off}`;
      this.said.classList.toggle("kind", failed);
      this.time.textContent = `${clock(this.at)} / ${clock(this.end)}`;
      this.slider.value = String(this.at);
      this.slider.setAttribute("aria-valuetext", `${clock(this.at)}, ${text}`);
    }
  }

  // A player is made when its place comes into view, or when somebody asks for a moment of it.
  const players = new Map();
  const playerOf = (element) => {
    if (!players.has(element)) players.set(element, new Player(element));
    return players.get(element);
  };
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) { seen.unobserve(entry.target); playerOf(entry.target); }
  }, {rootMargin: "200px"});
  for (const element of document.querySelectorAll(".replay")) {
    seen.observe(element);
    element.addEventListener("focusin", () => playerOf(element), {capture: true});
  }
  for (const link of document.querySelectorAll("[data-replay]")) {
    link.addEventListener("click", (event) => {
      const element = document.getElementById(link.dataset.replay);
      event.preventDefault();
      for (let at = element; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
      const player = playerOf(element);
      player.choose(Number(link.dataset.round));
      player.seek(Number(link.dataset.at));
      element.scrollIntoView({block: "center"});
      player.slider.focus({preventScroll: true});
    });
  }
})();
