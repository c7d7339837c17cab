import type { Robot } from "../store";

export function Files({ robot }: { robot: Robot }) {
  return <p class="hint">Files of {robot.key}</p>;
}
