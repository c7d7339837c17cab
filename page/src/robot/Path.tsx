// Where a robot without a virtual world has been, and the map of what its infrared sensors have met on the way.
import { computed } from "@preact/signals";
import { Save } from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { inks, prepared, stepOf } from "../look/canvas";
import { keep } from "../look/keep";
import { isDark } from "../look/theme";
import { number } from "../look/text";
import { can, hello, type Robot } from "../store";
import type { Place, RobotMap } from "./map";

const [ABOVE, BELOW] = [40, 56]; // px that the pose and the legend take

type Point = [x: number, y: number];

const inkOf = computed(() => (isDark(), inks("grid", "faint", "trail", "floor", "wall", "ink")));

function paint(canvas: HTMLCanvasElement, points: Point[], heading: number, map: RobotMap | null) {
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
    scale = Math.min((width - 40) / (right - left), (height - ABOVE - BELOW) / (high - low));
  if (Math.min(width, height) < 60) return; // there is no room for a picture
  const at: Place = (x, y) => [
    width / 2 + (x - (left + right) / 2) * scale,
    (height + ABOVE - BELOW) / 2 - (y - (low + high) / 2) * scale,
  ];
  // Where the robot was nothing stands, also where nobody looked meanwhile.
  const way = new Path2D();
  for (const point of points) way.lineTo(...at(...point));
  pen.lineJoin = pen.lineCap = "round";
  pen.lineWidth = 2 * hello.value!.body.sensor_radius * scale;
  pen.strokeStyle = ink.floor;
  pen.stroke(way);
  map?.drawOn(pen, at, scale, ink);
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
    tick = robot.tick.value,
    pose = tick?.pose ?? null;
  useEffect(() => {
    if (pose) paint(canvas.current!, [...robot.trail, [pose[0], pose[1]]], pose[2], robot.map);
  }, [tick, isDark()]);
  const save = () =>
    keep(
      "Save this map",
      "A picture for elib.Grid.open(), and a world for the simulator. The places are those of the wheels, which drift.",
      "room",
      (name) => robot.ask("save_map", { name }),
    );
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
        {can().files && (
          <Button weight="quiet" icon={Save} disabled={!robot.map} act={save}>
            Save map …
          </Button>
        )}
      </p>
    </div>
  );
}
