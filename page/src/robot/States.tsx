// The machine of states that drives a robot: a behaviour of the panel, a program that is watched, or a recording.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ask, type Robot } from "../store";
import { Machine } from "./Machine";

export function States({ robot }: { robot: Robot }) {
  const { count = 0, state = "", previous_state = "" } = robot.tick.value?.machine ?? {},
    svg = useSignal("");
  useEffect(() => {
    let isOld = false; // another machine may begin before the answer comes
    svg.value = "";
    if (count) ask("states", { robot: robot.key }).then((found) => isOld || (svg.value = found ?? ""));
    return () => void (isOld = true);
  }, [count]);
  return svg.value ? <Machine svg={svg.value} states={[state, previous_state]} /> : null;
}
