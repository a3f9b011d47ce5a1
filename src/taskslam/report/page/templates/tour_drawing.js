// Draws one moment of a tour over the picture of its floor plan: robot, estimate, ways, scan, failures.
//
//   const drawing = new TourDrawing(canvas, facts, () => draw());
//   drawing.draw({truth, estimate, ways: {truth, estimate}, target, scan, map, failures});
//
// facts as replay.py writes them: view, radius, goals, plan, lidar. Poses are [x, y, theta] in `map` or null, ways lists
// of them; target: index of the goal that the robot heads for, or null; scan, map: points [x, y, x, y, ...] in `map`,
// or null; failures: places [x, y]. ready: called once the floor plan can be cast rays into, or when colours change.
const TourDrawing = (() => {
  const RAYS = 240;
  const COLOURS = ["paper", "ink", "muted", "blue", "orange", "green", "vermilion"];

  // Whether a cell of the plan is a wall: dark and opaque in its picture, as plan_drawing.py paints it.
  const wallsOf = (picture) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.naturalWidth, picture.naturalHeight];
    const brush = canvas.getContext("2d", {willReadFrequently: true});
    brush.drawImage(picture, 0, 0);
    const pixels = brush.getImageData(0, 0, canvas.width, canvas.height).data;
    const walls = new Uint8Array(canvas.width * canvas.height);
    for (let index = 0; index < walls.length; index++) walls[index] = pixels[4 * index + 3] > 127 && pixels[4 * index] < 128;
    return {walls, columns: canvas.width, rows: canvas.height};
  };

  class Drawing {
    constructor(canvas, facts, ready = () => {}) {
      this.canvas = canvas;
      this.facts = facts;
      this.brush = canvas.getContext("2d");
      this.grid = null;
      this.recolour();
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.recolour(); ready(); });
      const source = facts.plan && document.getElementById(facts.plan.picture);
      if (source && facts.lidar) {
        const picture = new Image();
        picture.addEventListener("load", () => { this.grid = wallsOf(picture); ready(); });
        picture.setAttribute("src", source.getAttribute("href"));
      }
    }

    recolour() {
      const style = getComputedStyle(document.documentElement);
      this.ink = Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    }

    // The points that a LiDAR at a pose would see if the floor plan were all there is, as seen from another pose.
    cast(from, seen) {
      if (!this.grid || !from || !seen) return null;
      const {plan, lidar: [ahead, left, turn, first, last, range]} = this.facts;
      const {walls, columns, rows} = this.grid;
      const [ox, oy, otheta] = plan.origin;
      const [oc, os] = [Math.cos(otheta), Math.sin(otheta)];
      const [c, s] = [Math.cos(from[2]), Math.sin(from[2])];
      const [dx, dy] = [from[0] + c * ahead - s * left - ox, from[1] + s * ahead + c * left - oy];
      const [gx, gy] = [(oc * dx + os * dy) / plan.resolution, (-os * dx + oc * dy) / plan.resolution];
      const [sc, ss] = [Math.cos(seen[2]), Math.sin(seen[2])];
      const [sx, sy] = [seen[0] + sc * ahead - ss * left, seen[1] + ss * ahead + sc * left];
      const points = [];
      for (let ray = 0; ray < RAYS; ray++) {
        const bearing = turn + first + (last - first) * ray / (RAYS - 1);
        const distance = this.march(walls, columns, rows, gx, gy, from[2] + bearing - otheta, range / plan.resolution);
        if (distance === null) continue;
        const metres = distance * plan.resolution;
        points.push(sx + metres * Math.cos(seen[2] + bearing), sy + metres * Math.sin(seen[2] + bearing));
      }
      return points;
    }

    // Cells from (x, y) to the first wall in a direction, through every cell that the ray crosses; null without one.
    march(walls, columns, rows, x, y, direction, most) {
      const [ux, uy] = [Math.cos(direction), Math.sin(direction)];
      let [column, row] = [Math.floor(x), Math.floor(y)];
      const [stepX, stepY] = [Math.sign(ux), Math.sign(uy)];
      const [perX, perY] = [Math.abs(1 / ux), Math.abs(1 / uy)];
      let toX = (ux > 0 ? column + 1 - x : x - column) * perX;
      let toY = (uy > 0 ? row + 1 - y : y - row) * perY;
      for (let gone = 0; gone <= most;) {
        if (column < 0 || row < 0 || column >= columns || row >= rows) return null;
        if (walls[(rows - 1 - row) * columns + column]) return gone;
        if (toX < toY) { gone = toX; toX += perX; column += stepX; } else { gone = toY; toY += perY; row += stepY; }
      }
      return null;
    }

    draw(moment) {
      const {canvas, brush, ink, facts: {view: [left, top, scale, width, height], radius, goals}} = this;
      const pixels = Math.max(1, Math.round(canvas.clientWidth * (window.devicePixelRatio || 1)));
      if (canvas.width !== pixels) {
        canvas.width = pixels;
        canvas.height = Math.round(pixels * canvas.clientHeight / Math.max(1, canvas.clientWidth));
      }
      const unit = pixels / width;
      const thick = 1 / Math.min(1, canvas.clientWidth / width);  // lines keep their width where the drawing is small
      brush.setTransform(unit, 0, 0, unit, 0, 0);
      brush.clearRect(0, 0, width, height + 100);
      const at = (x, y) => [(x - left) * scale, (top - y) * scale];
      const dots = (points, size, colour, alpha) => {
        brush.fillStyle = colour;
        brush.globalAlpha = alpha;
        for (let index = 0; index < points.length; index += 2) {
          const [x, y] = at(points[index], points[index + 1]);
          brush.fillRect(x - size / 2, y - size / 2, size, size);
        }
        brush.globalAlpha = 1;
      };
      const line = (places, colour, lineWidth, alpha = 1) => {
        brush.beginPath();
        let drawn = false;
        for (const place of places) {
          if (place) brush[drawn ? "lineTo" : "moveTo"](...at(place[0], place[1]));
          drawn = place !== null;
        }
        Object.assign(brush, {strokeStyle: colour, lineWidth, globalAlpha: alpha, lineJoin: "round", lineCap: "round"});
        brush.stroke();
        brush.globalAlpha = 1;
      };
      const robot = ([x, y, theta], colour, dashed) => {
        const [px, py] = at(x, y);
        const size = Math.max(radius * scale, 5 * thick);
        brush.beginPath();
        brush.arc(px, py, size, 0, 2 * Math.PI);
        Object.assign(brush, {strokeStyle: colour, fillStyle: colour, lineWidth: 2.2 * thick});
        brush.globalAlpha = dashed ? 0.12 : 0.3;
        brush.fill();
        brush.globalAlpha = 1;
        brush.setLineDash(dashed ? [4 * thick, 3 * thick] : []);
        brush.stroke();
        brush.setLineDash([]);
        line([[x, y], [x + 1.35 * size / scale * Math.cos(theta), y + 1.35 * size / scale * Math.sin(theta)]], colour, 2.6 * thick);
      };
      if (moment.map) dots(moment.map, 2 * thick, ink.orange, 0.35);
      line(moment.ways.estimate, ink.orange, 5 * thick, 0.5);
      line(moment.ways.truth, ink.blue, 1.8 * thick);
      if (moment.scan) dots(moment.scan, 3.6 * thick, ink.green, 0.9);
      if (moment.target !== null) {
        const [x, y] = at(...goals[moment.target]);
        brush.beginPath();
        brush.arc(x, y, 19, 0, 2 * Math.PI);
        Object.assign(brush, {strokeStyle: ink.blue, lineWidth: 3.2});
        brush.stroke();
      }
      if (moment.estimate) robot(moment.estimate, ink.orange, true);
      if (moment.truth) robot(moment.truth, ink.blue, false);
      for (const [x, y] of moment.failures) {
        const [px, py] = at(x, y);
        for (const [colour, lineWidth] of [[ink.paper, 8], [ink.vermilion, 4]]) {
          Object.assign(brush, {strokeStyle: colour, lineWidth: lineWidth * thick, lineCap: "round"});
          for (const side of [-9 * thick, 9 * thick]) {
            brush.beginPath();
            brush.moveTo(px - side, py - 9 * thick);
            brush.lineTo(px + side, py + 9 * thick);
            brush.stroke();
          }
        }
      }
    }
  }
  return Drawing;
})();
