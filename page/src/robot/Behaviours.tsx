import type { Robot } from "../store";

export function Behaviours({ robot }: { robot: Robot }) {
  return <p class="hint">Behaviours of {robot.key}</p>;
}
