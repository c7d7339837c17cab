// What the page knows of elib before Python is there: tables that are made when the studio is built.
import { signal } from "@preact/signals";

/** A command of the robot, or a name of elib. */
export type Known = {
  name: string;
  signature: string;
  about: string;
  arguments: [name: string, rule: string][];
  example: string;
};
type Sample = { name: string; about: string; text: string };

export const known = signal({
  robot: [] as Known[],
  elib: [] as Known[],
  firmwares: [] as string[],
  faults: [] as [name: string, about: string][],
  samples: [] as Sample[],
  machine: "", // a program of states to begin with
});

/** What a beginner needs of a robot before all else. */
export const BASICS = ["drive", "turn", "set_speed", "stop", "sleep", "proximity"];

/** Load the tables: after the page is drawn, for nobody writes as fast as that. */
export async function load() {
  known.value = await (await fetch("known.json")).json();
}
