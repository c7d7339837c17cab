// The time line of a recording that is played: pause it, let it go on, and go to any moment.
import { useSignal } from "@preact/signals";
import { Pause, Play } from "lucide";
import { Button } from "../look/Button";
import { number } from "../look/text";
import type { Robot } from "../store";
import "./lists.css";

export function Playback({ robot }: { robot: Robot }) {
  const held = useSignal<number | null>(null), // where a hand holds the slider
    playback = robot.tick.value?.playback;
  if (!playback) return null;
  const { length, paused } = playback,
    at = held.value ?? playback.at;
  const seek = async (seconds: number) => {
    await robot.ask("seek", { seconds });
    held.value = null;
  };
  return (
    <div class="playback row">
      <Button
        weight="primary"
        icon={paused ? Play : Pause}
        label={paused ? "Go on" : "Pause recording"}
        act={() => robot.ask("pause_playback", { on: !paused })}
      />
      <input
        class="fill"
        type="range"
        min={0}
        max={length}
        step={0.1}
        value={at}
        aria-label="moment of the recording, seconds"
        onInput={(event) => (held.value = event.currentTarget.valueAsNumber)}
        onChange={(event) => seek(event.currentTarget.valueAsNumber)}
      />
      <output>{`${number(at, 1)} of ${number(length, 1)} s`}</output>
    </div>
  );
}
