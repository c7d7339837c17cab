import type { Robot } from "../store";

export function Sensors({ robot }: { robot: Robot }) {
  return <p class="hint">Sensors of {robot.key}</p>;
}
