// Where a robot without a virtual world has been, and what its infrared sensors have met on the way: an occupancy sketch.
import { computed } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { inks, prepared, stepOf } from "../look/canvas";
import { isDark } from "../look/theme";
import { number } from "../look/text";
import { hello, type Robot } from "../store";

const CELL = 0.01; // m, the side of a square of the sketch
const SIDE = 64; // squares along a side of a tile
const MAX_TILES = 400; // 160 m² of floor, 8 MB
const SIGHT = 0.05; // m: what a sensor that meets nothing has seen to be free
const FREE = 0.03; // m between the middle and a robot's rim, and a little: where it stands is free
const SURE = 6; // readings after which a square cannot become surer

type Point = [x: number, y: number];
type Place = (x: number, y: number) => Point;

const inkOf = computed(() => (isDark(), inks("grid", "faint", "trail", "floor", "wall", "ink")));

/** A part of the floor, as a picture of one pixel for each square: a square is painted when it changes, not at each look. */
class Tile {
  readonly canvas = document.createElement("canvas");
  private readonly pen = this.canvas.getContext("2d")!;
  private readonly weights = new Int8Array(SIDE * SIDE); // above 0 something is there, below 0 nothing is
  private ink = inkOf.value;

  /** The tile begins at so many tiles from the origin, to the right and up. */
  constructor(
    readonly column: number,
    readonly row: number,
  ) {
    this.canvas.width = this.canvas.height = SIDE;
  }

  mark(index: number, weight: number) {
    this.weights[index] = Math.max(-SURE, Math.min(SURE, this.weights[index] + weight));
    this.paint(index);
  }

  drawOn(pen: CanvasRenderingContext2D, at: Place) {
    if (this.ink !== inkOf.value) {
      this.ink = inkOf.value;
      this.weights.forEach((_, index) => this.paint(index));
    }
    // In whole pixels, so that there is no seam between two tiles.
    const [left, bottom] = at(this.column * SIDE * CELL, this.row * SIDE * CELL).map(Math.round),
      [right, top] = at((this.column + 1) * SIDE * CELL, (this.row + 1) * SIDE * CELL).map(Math.round);
    pen.drawImage(this.canvas, left, top, right - left, bottom - top);
  }

  private paint(index: number) {
    const weight = this.weights[index],
      square = [index % SIDE, SIDE - 1 - Math.floor(index / SIDE), 1, 1] as const;
    this.pen.clearRect(...square);
    if (!weight) return;
    this.pen.globalAlpha = weight > 0 ? 0.2 + (0.8 * weight) / SURE : 1;
    this.pen.fillStyle = weight > 0 ? this.ink.wall : this.ink.floor;
    this.pen.fillRect(...square);
  }
}

/** What the sensors have met. Where the robot was long ago is forgotten first. */
class Sketch {
  private readonly tiles = new Map<string, Tile>();

  note([x, y, heading]: [number, number, number], distances: (number | null)[]) {
    const { ring, body } = hello.value!,
      rim = body.sensor_radius;
    this.mark(x, y, -SURE);
    distances.forEach((metres, sensor) => {
      const far = metres ?? Infinity,
        angle = heading + ring.sensors[sensor],
        [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
      for (let along = FREE; along < rim + Math.min(far, SIGHT) - CELL; along += CELL)
        this.mark(x + along * cosine, y + along * sine, -1);
      if (far < SIGHT) this.mark(x + (rim + far) * cosine, y + (rim + far) * sine, 2);
    });
  }

  drawOn(pen: CanvasRenderingContext2D, at: Place, scale: number) {
    pen.imageSmoothingEnabled = CELL * scale < 1; // squares that share a pixel are mixed
    for (const tile of this.tiles.values()) tile.drawOn(pen, at);
  }

  private mark(x: number, y: number, weight: number) {
    const [column, row] = [Math.floor(x / CELL), Math.floor(y / CELL)],
      [across, up] = [Math.floor(column / SIDE), Math.floor(row / SIDE)],
      key = `${across} ${up}`,
      tile = this.tiles.get(key) ?? new Tile(across, up);
    this.tiles.delete(key);
    this.tiles.set(key, tile); // the newest is the last
    if (this.tiles.size > MAX_TILES) this.tiles.delete(this.tiles.keys().next().value!);
    tile.mark((row - up * SIDE) * SIDE + column - across * SIDE, weight);
  }
}

function paint(canvas: HTMLCanvasElement, points: Point[], heading: number, sketch: Sketch) {
  const { pen, width, height } = prepared(canvas),
    ink = inkOf.value,
    xs = points.map(([x]) => x),
    ys = points.map(([, y]) => y),
    [left, right, low, high] = [
      Math.min(...xs) - 0.1,
      Math.max(...xs) + 0.1,
      Math.min(...ys) - 0.1,
      Math.max(...ys) + 0.1,
    ],
    scale = Math.min((width - 40) / (right - left), (height - 40) / (high - low));
  if (Math.min(width, height) < 60) return; // there is no room for a picture
  const at: Place = (x, y) => [
    width / 2 + (x - (left + right) / 2) * scale,
    height / 2 - (y - (low + high) / 2) * scale,
  ];
  // Where the robot was nothing stands, also where nobody looked meanwhile.
  const way = new Path2D();
  for (const point of points) way.lineTo(...at(...point));
  pen.lineJoin = pen.lineCap = "round";
  pen.lineWidth = 2 * hello.value!.body.sensor_radius * scale;
  pen.strokeStyle = ink.floor;
  pen.stroke(way);
  sketch.drawOn(pen, at, scale);
  const step = stepOf(scale, 36),
    [originX, originY] = at(0, 0);
  pen.beginPath();
  for (let x = originX % (step * scale); x < width; x += step * scale) (pen.moveTo(x, 0), pen.lineTo(x, height));
  for (let y = originY % (step * scale); y < height; y += step * scale) (pen.moveTo(0, y), pen.lineTo(width, y));
  pen.lineWidth = 1;
  pen.strokeStyle = ink.grid;
  pen.stroke();
  pen.lineWidth = 2;
  pen.strokeStyle = ink.trail;
  pen.stroke(way);
  const [x, y] = at(...points[points.length - 1]),
    radius = Math.max(8, hello.value!.body.sensor_radius * scale);
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.moveTo(x + 0.4 * radius * Math.cos(heading), y - 0.4 * radius * Math.sin(heading));
  pen.lineTo(x + radius * Math.cos(heading), y - radius * Math.sin(heading));
  pen.strokeStyle = ink.ink;
  pen.stroke();
  pen.fillStyle = ink.faint;
  pen.font = "12px Inter Variable, sans-serif";
  pen.textAlign = "right";
  pen.fillText(`a square: ${step < 1 ? `${Math.round(100 * step)} cm` : `${step} m`}`, width - 12, 22);
}

export function Path({ robot }: { robot: Robot }) {
  const canvas = useRef<HTMLCanvasElement>(null),
    sketch = useRef(new Sketch());
  const tick = robot.tick.value,
    pose = tick?.pose ?? null,
    near = tick?.readings.proximity;
  useEffect(() => {
    if (!tick || !pose) return;
    if (tick.trail.whole && robot.trail.length < 2) sketch.current = new Sketch(); // another journey
    if (near?.values && !near.stale) sketch.current.note(pose, tick.distances);
    paint(canvas.current!, [...robot.trail, [pose[0], pose[1]]], pose[2], sketch.current);
  }, [tick, isDark()]);
  return (
    <div class="path">
      <canvas ref={canvas} role="img" aria-label="path of the robot, and what its sensors have met" />
      <p class="chip-like">
        {pose
          ? `x ${number(pose[0], 3)} m   y ${number(pose[1], 3)} m   heading ${number((pose[2] * 180) / Math.PI)}°`
          : "Connect the robot: its path and what it sees are drawn here."}
      </p>
      <p class="legend">
        <i class="met" aria-hidden="true" /> something there
        <i class="free" aria-hidden="true" /> free
        <i class="unseen" aria-hidden="true" /> not seen yet
      </p>
    </div>
  );
}
