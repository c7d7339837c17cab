import type { Robot } from "../store";

export function Events({ robot }: { robot: Robot }) {
  return <p class="hint">Events of {robot.key}</p>;
}
