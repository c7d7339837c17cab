import type { Robot } from "../store";

export function Console({ robot }: { robot: Robot }) {
  return <p class="hint">Console of {robot.key}</p>;
}
