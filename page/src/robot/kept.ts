import type { Robot } from "../store";

/** What a part of the page keeps of a robot while another part is open. */
export function kept<State>(make: () => State) {
  const states = new WeakMap<Robot, State>();
  return (robot: Robot) => {
    const state = states.get(robot) ?? make();
    states.set(robot, state);
    return state;
  };
}

/** A list with something more, or without it if it was there. */
export const toggled = <T>(list: T[], each: T) =>
  list.includes(each) ? list.filter((other) => other !== each) : [...list, each];
