import type { Robot } from "../store";

export function Link({ robot }: { robot: Robot }) {
  return <p class="hint">Link of {robot.key}</p>;
}
