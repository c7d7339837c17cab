import type { Robot } from "../store";

export function Camera({ robot }: { robot: Robot }) {
  return <p class="hint">Camera of {robot.key}</p>;
}
