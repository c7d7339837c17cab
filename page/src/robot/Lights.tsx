import type { Robot } from "../store";

export function Lights({ robot }: { robot: Robot }) {
  return <p class="hint">Lights of {robot.key}</p>;
}
