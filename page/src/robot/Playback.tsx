import type { Robot } from "../store";

export function Playback({ robot }: { robot: Robot }) {
  return <p class="hint">Playback of {robot.key}</p>;
}
