// What a part of the page keeps of a robot while another part is open.
import type { Robot } from "../store";

export function kept<State>(make: () => State) {
  const states = new WeakMap<Robot, State>();
  return (robot: Robot) => {
    const state = states.get(robot) ?? make();
    states.set(robot, state);
    return state;
  };
}
