// The place of the page is its address: "#/robot/1/charts". It can be kept, shared, and gone back from.
import { computed, signal } from "@preact/signals";
import { hello, listed } from "./store";

export type Place = { kind: "start" | "all" | "robot"; robot: string; part: string };

const hash = signal(location.hash);
addEventListener("hashchange", () => (hash.value = location.hash));

/** What is shown: what the address says if it is there, otherwise what there is to see first. */
export const place = computed<Place>(() => {
  const [kind, robot = "", part = ""] = hash.value.replace(/^#\//, "").split("/");
  const robots = listed.value,
    mayConnect = hello.value?.can.connect ?? false;
  if (kind === "start" && mayConnect) return { kind, robot: "", part: "" };
  if (kind === "all" && (robots.length || !mayConnect)) return { kind, robot: "", part: robot };
  if (kind === "robot" && robots.some(({ key }) => key === robot)) return { kind, robot, part };
  if (robots.length === 1) return { kind: "robot", robot: robots[0].key, part: "" };
  return { kind: robots.length || !mayConnect ? "all" : "start", robot: "", part: "" };
});

/** The number of the student of a class whose page this is; empty for everybody else. */
export const student = /^\/student\/(\d+)/.exec(location.pathname)?.[1] ?? "";

export const address = (robot: string, part = "") => `#/robot/${robot}${part && `/${part}`}`;

export function go(to: string) {
  location.hash = to;
}
