// Where a robot without a virtual world has been, and what its infrared sensors have met on the way: an occupancy sketch.
import { useEffect, useRef } from "preact/hooks";
import { inks, prepared, stepOf } from "../look/canvas";
import { isDark } from "../look/theme";
import { number } from "../look/text";
import { hello, type Robot } from "../store";

const CELL = 0.01; // m, the side of a square of the sketch
const RIM = 0.035; // m from the middle of the robot to its sensors
const SIGHT = 0.05; // m: what a sensor that meets nothing has seen to be free
const FREE = 0.03; // m between the middle and a robot's rim, and a little: where it stands is free
const SURE = 6; // readings after which a square cannot become surer
const MAX_CELLS = 40_000;

type Point = [x: number, y: number];

/** What the sensors have met: above 0 something is there, below 0 nothing is. */
class Sketch {
  readonly cells = new Map<string, number>();

  note([x, y, heading]: [number, number, number], distances: (number | null)[], angles: number[]) {
    if (this.cells.size > MAX_CELLS) return;
    this.mark(x, y, -SURE);
    distances.forEach((metres, sensor) => {
      const far = metres ?? Infinity,
        angle = heading + angles[sensor],
        [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
      for (let along = FREE; along < RIM + Math.min(far, SIGHT) - CELL; along += CELL)
        this.mark(x + along * cosine, y + along * sine, -1);
      if (far < SIGHT) this.mark(x + (RIM + far) * cosine, y + (RIM + far) * sine, 2);
    });
  }

  private mark(x: number, y: number, weight: number) {
    const key = `${Math.floor(x / CELL)} ${Math.floor(y / CELL)}`;
    this.cells.set(key, Math.max(-SURE, Math.min(SURE, (this.cells.get(key) ?? 0) + weight)));
  }
}

function paint(canvas: HTMLCanvasElement, points: Point[], heading: number, sketch: Sketch) {
  const { pen, width, height } = prepared(canvas),
    ink = inks("grid", "faint", "trail", "floor", "wall", "ink"),
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
  const at = (x: number, y: number): Point => [
    width / 2 + (x - (left + right) / 2) * scale,
    height / 2 - (y - (low + high) / 2) * scale,
  ];
  for (const [key, weight] of sketch.cells) {
    const [column, row] = key.split(" ").map(Number),
      corner = at(column * CELL, (row + 1) * CELL);
    pen.globalAlpha = weight > 0 ? 0.2 + (0.8 * weight) / SURE : 1;
    pen.fillStyle = weight > 0 ? ink.wall : ink.floor;
    if (weight) pen.fillRect(...corner, CELL * scale + 0.6, CELL * scale + 0.6);
  }
  pen.globalAlpha = 1;
  const step = stepOf(scale, 36),
    [originX, originY] = at(0, 0);
  pen.beginPath();
  for (let x = originX % (step * scale); x < width; x += step * scale) (pen.moveTo(x, 0), pen.lineTo(x, height));
  for (let y = originY % (step * scale); y < height; y += step * scale) (pen.moveTo(0, y), pen.lineTo(width, y));
  pen.strokeStyle = ink.grid;
  pen.stroke();
  pen.beginPath();
  for (const point of points) pen.lineTo(...at(...point));
  pen.lineJoin = pen.lineCap = "round";
  pen.lineWidth = 2;
  pen.strokeStyle = ink.trail;
  pen.stroke();
  const [x, y] = at(...points[points.length - 1]),
    radius = Math.max(8, RIM * scale);
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.moveTo(x + 0.4 * radius * Math.cos(heading), y - 0.4 * radius * Math.sin(heading));
  pen.lineTo(x + radius * Math.cos(heading), y - radius * Math.sin(heading));
  pen.strokeStyle = ink.ink;
  pen.stroke();
  pen.fillStyle = ink.faint;
  pen.font = "12px Inter Variable, sans-serif";
  pen.textAlign = "right";
  pen.fillText(`a square: ${step < 1 ? `${Math.round(100 * step)} cm` : `${step} m`}`, width - 12, height - 12);
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
    if (near?.values && !near.stale) sketch.current.note(pose, tick.distances, hello.value?.ring.sensors ?? []);
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
