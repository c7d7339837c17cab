import type { Robot } from "../store";

export function Pad({ robot }: { robot: Robot }) {
  return <p class="hint">Pad of {robot.key}</p>;
}
