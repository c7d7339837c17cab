import type { Robot } from "../store";

export function Charts({ robot }: { robot: Robot }) {
  return <p class="hint">Charts of {robot.key}</p>;
}
