// Drawing on a canvas: circles, lines, a grid, and an e-puck from above as in World.draw() (elib/simulator/drawing/robot.py).

const TOUCHING = 1,
  BODY = 2,
  FRONT = 4;
export const CUT = 8;

/** @type {Record<string, string[]>} */
export const HUES = {
  light: ["#185a9d", "#c75116", "#2e7d50", "#8e448f", "#b02a48", "#606014", "#0e7490", "#5b5bd6"],
  dark: ["#6fb1f0", "#f2965a", "#7fd6a2", "#d59ad6", "#f08aa4", "#cfcf6a", "#5cc8dc", "#a5a5ff"],
};

/** @typedef {[x: number, y: number]} Point */
/** @typedef {CanvasRenderingContext2D} Pen */

const STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200]; // m
const DARK = new Uint8Array(24); // no LED is lit

/** @param {Pen} pen @param {Point} centre @param {number} radius */
export function circle(pen, [x, y], radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 7);
}

/** @param {Pen} pen @param {...Point} points */
export function line(pen, ...points) {
  pen.beginPath();
  for (const point of points) pen.lineTo(...point);
}

/**
 * Fill the shape that was begun and draw its edge; what has no colour is left out.
 * @param {Pen} pen @param {string} fill @param {string} [edge] @param {number} [width]
 */
export function paint(pen, fill, edge = "", width = 2) {
  pen.fillStyle = fill;
  if (fill) pen.fill();
  pen.strokeStyle = edge;
  pen.lineWidth = width;
  if (edge) pen.stroke();
}

/**
 * A round number of metres that is at least so many pixels long.
 * @param {number} scale pixels for 1 m
 * @param {number} least
 */
export const stepOf = (scale, least) => STEPS.find((step) => step * scale >= least) ?? 500;

/**
 * Begin the lines of a grid through a point, `step` pixels apart, between two corners.
 * @param {Pen} pen @param {number} step @param {Point} through @param {Point} leftTop @param {Point} rightBottom
 */
export function grid(pen, step, through, [left, top], [right, bottom]) {
  const [x0, y0] = [through[0] - left, through[1] - top].map((far) => ((far % step) + step) % step);
  pen.beginPath();
  for (let x = left + x0; x < right; x += step) {
    pen.moveTo(x, top);
    pen.lineTo(x, bottom);
  }
  for (let y = top + y0; y < bottom; y += step) {
    pen.moveTo(left, y);
    pen.lineTo(right, y);
  }
}

/**
 * Draw one robot.
 * @param {Pen} pen
 * @param {[x: number, y: number, heading: number]} pose in pixels
 * @param {number} radius in pixels
 * @param {string} rim a colour
 * @param {number[]} leds the angles of its ring
 * @param {number} [bits] of what is lit and touched
 * @param {Uint8Array} [ring] the colours of its LEDs
 */
export function drawRobot(pen, [x, y, heading], radius, rim, leds, bits = 0, ring = DARK) {
  const cosine = Math.cos(heading),
    sine = Math.sin(heading);
  /** @type {(ahead: number, left: number) => Point} */
  const place = (ahead, left) => [
    x + radius * (cosine * ahead - sine * left),
    y - radius * (sine * ahead + cosine * left),
  ];
  /** @type {(centre: Point, size: number, fill: string) => void} */
  const disc = (centre, size, fill) => {
    circle(pen, centre, Math.max(0.5, size * radius));
    paint(pen, fill);
  };
  const isLit = (bits & BODY) !== 0;
  disc([x, y], 1, bits & TOUCHING ? "#c04a3a" : rim);
  disc([x, y], 0.94, "#424952");
  for (const side of [-1, 1]) {
    const [inner, outer] = [0.66 * side, 0.84 * side];
    line(pen, place(-0.34, inner), place(0.34, inner), place(0.34, outer), place(-0.34, outer));
    paint(pen, "#1c1e22");
  }
  disc([x, y], 0.66, isLit ? "#78ec6e" : "#b2d6a8");
  disc([x, y], 0.5, isLit ? "#479256" : "#2c6242");
  line(pen, place(0.46, 0), place(-0.22, 0.28), place(-0.1, 0), place(-0.22, -0.28));
  paint(pen, "#fafaf6");
  leds.forEach((turn, led) => {
    const colour = ring.subarray(3 * led, 3 * led + 3).join(),
      spot = place(0.86 * Math.cos(turn), 0.86 * Math.sin(turn));
    if (colour === "0,0,0") return disc(spot, 0.055, "#8cac84");
    disc(spot, 0.3, `rgba(${colour},0.28)`);
    disc(spot, 0.15, `rgb(${colour})`);
    disc(spot, 0.06, "rgba(255,255,255,0.75)");
  });
  if (bits & FRONT) {
    disc(place(0.93, -0.34), 0.26, "rgba(255,140,40,0.35)");
    disc(place(0.93, -0.34), 0.11, "#ff8c28");
  }
}

/**
 * Draw infrared rays: five numbers each, start, end and strength. A pale rim makes them readable on every floor.
 * @param {Pen} pen
 * @param {Float32Array} rays
 * @param {(x: number, y: number) => Point} toPixel
 */
export function drawRays(pen, rays, toPixel) {
  for (let ray = 0; ray < rays.length; ray += 5) {
    const lit = Math.min(1, rays[ray + 4] * 4); // a quarter of full scale is very near already
    const end = toPixel(rays[ray + 2], rays[ray + 3]);
    pen.globalAlpha = lit < 0.02 ? 0.35 : 1; // one that met nothing
    const colour = `rgb(${150 + 70 * lit}, ${90 - 70 * lit}, ${150 - 130 * lit})`;
    line(pen, toPixel(rays[ray], rays[ray + 1]), end);
    paint(pen, "", "rgba(255, 255, 255, 0.8)", 3.4 + 2 * lit);
    paint(pen, "", colour, 1.4 + 2 * lit);
    if (pen.globalAlpha < 1) continue;
    circle(pen, end, 2 + 2 * lit);
    paint(pen, colour);
  }
  pen.globalAlpha = 1;
}
