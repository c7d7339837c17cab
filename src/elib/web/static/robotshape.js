// An e-puck from above, as in the pictures of World.draw() (elib/view/robot.py).

const TOUCHING = 1,
  BODY = 2,
  FRONT = 4;
export const CUT = 8;

export const HUES = {
  light: ["#185a9d", "#c75116", "#2e7d50", "#8e448f", "#b02a48", "#606014"],
  dark: ["#6fb1f0", "#f2965a", "#7fd6a2", "#d59ad6", "#f08aa4", "#cfcf6a"],
};

/** @typedef {[x: number, y: number]} Point */
/** @typedef {CanvasRenderingContext2D} Pen */

/**
 * Draw one robot.
 * @param {Pen} pen
 * @param {Point} at its centre in pixels
 * @param {number} heading
 * @param {number} radius in pixels
 * @param {number} bits of what is lit and touched
 * @param {Uint8Array} ring the colours of its LEDs
 * @param {number[]} leds the angles of its ring
 * @param {string} rim a colour
 */
export function drawRobot(pen, at, heading, radius, bits, ring, leds, rim) {
  const cosine = Math.cos(heading),
    sine = Math.sin(heading);
  /** @type {(ahead: number, left: number) => Point} */
  const place = (ahead, left) => [
    at[0] + radius * (cosine * ahead - sine * left),
    at[1] - radius * (sine * ahead + cosine * left),
  ];
  /** @type {(centre: Point, size: number, fill: string) => void} */
  const disc = (centre, size, fill) => {
    pen.beginPath();
    pen.arc(centre[0], centre[1], Math.max(0.5, size * radius), 0, 7);
    pen.fillStyle = fill;
    pen.fill();
  };
  /** @type {(points: Point[], fill: string) => void} */
  const area = (points, fill) => {
    pen.beginPath();
    for (const [ahead, left] of points) pen.lineTo(...place(ahead, left));
    pen.closePath();
    pen.fillStyle = fill;
    pen.fill();
  };
  const isLit = (bits & BODY) !== 0;
  disc(at, 1, bits & TOUCHING ? "#c04a3a" : rim);
  disc(at, 0.94, "#424952");
  for (const side of [-1, 1]) {
    area(
      [
        [-0.34, 0.66 * side],
        [0.34, 0.66 * side],
        [0.34, 0.84 * side],
        [-0.34, 0.84 * side],
      ],
      "#1c1e22",
    );
  }
  disc(at, 0.66, isLit ? "#78ec6e" : "#b2d6a8");
  disc(at, 0.5, isLit ? "#479256" : "#2c6242");
  area(
    [
      [0.46, 0],
      [-0.22, 0.28],
      [-0.1, 0],
      [-0.22, -0.28],
    ],
    "#fafaf6",
  );
  for (let led = 0; led < 8; led++) {
    const red = ring[3 * led],
      green = ring[3 * led + 1],
      blue = ring[3 * led + 2];
    const spot = place(0.86 * Math.cos(leds[led]), 0.86 * Math.sin(leds[led]));
    if (red || green || blue) {
      disc(spot, 0.3, `rgba(${red},${green},${blue},0.28)`);
      disc(spot, 0.15, `rgb(${red},${green},${blue})`);
      disc(spot, 0.06, "rgba(255,255,255,0.75)");
    } else disc(spot, 0.055, "#8cac84");
  }
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
    pen.beginPath();
    pen.moveTo(...toPixel(rays[ray], rays[ray + 1]));
    pen.lineTo(...end);
    pen.strokeStyle = "rgba(255, 255, 255, 0.8)";
    pen.lineWidth = 3.4 + 2 * lit;
    pen.stroke();
    pen.strokeStyle = pen.fillStyle = `rgb(${150 + 70 * lit}, ${90 - 70 * lit}, ${150 - 130 * lit})`;
    pen.lineWidth = 1.4 + 2 * lit;
    pen.stroke();
    if (lit < 0.02) continue; // it met nothing
    pen.beginPath();
    pen.arc(...end, 2 + 2 * lit, 0, 7);
    pen.fill();
  }
}
