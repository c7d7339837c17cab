// How good the link is: how long answers take, and what was lost.
import { CircleCheck, TriangleAlert, Unplug } from "lucide";
import { useMemo } from "preact/hooks";
import { Facts } from "../look/fields";
import { Icon } from "../look/Icon";
import { age, milliseconds, number } from "../look/text";
import type { LinkStats } from "../messages";
import type { Robot } from "../store";
import { columns, Plot, ROUND_TRIP } from "./Plot";
import { SLOW } from "./Status";
import "./lists.css";

const SPAN = 60; // s of the chart

const rows = (link: LinkStats): [title: string, text: string | number][] => [
  ["Time to an answer, usually", milliseconds(link.median)],
  ["Time to an answer, 99 of 100", milliseconds(link.p99)],
  ["Commands without an answer", link.loss === null ? "?" : `${link.lost} (${number(100 * link.loss, 1)} %)`],
  ["Last answer", link.age === null ? "?" : `${age(link.age)} ago`],
  ["Answers received", link.count],
  ["Commands that wait", link.waiting],
  ["Commands that the robot did not know", link.refused],
  ["Commands given up before they were sent", link.unsent],
  ["Order of answers restored", `${link.resyncs} times`],
  ["Restarts of the robot", link.resets],
];

/** How good a link is, in a sentence. */
function verdict({ median, loss, lost }: LinkStats) {
  if (median === null) return [Unplug, "", "No answer has come yet."] as const;
  const isGood = median < SLOW && (loss ?? 0) < 0.01,
    text = `answers take ${milliseconds(median)}, ${lost ? `${lost} were lost` : "nothing lost"}.`;
  return isGood
    ? ([CircleCheck, "good", `The link is good: ${text}`] as const)
    : ([TriangleAlert, "warn", `The link is poor: ${text}`] as const);
}

export function Link({ robot }: { robot: Robot }) {
  const { link = null, phase } = robot.tick.value ?? {},
    isOn = phase === "connected",
    [icon, kind, text] = link && isOn ? verdict(link) : [Unplug, "", "Not connected."],
    data = useMemo(() => columns(ROUND_TRIP, robot.history, SPAN), [robot.tick.value]);
  return (
    <div class={`stack fill link ${isOn ? "" : "stale"}`}>
      <p class={`row ${kind}`}>
        <Icon of={icon} /> {text}
      </p>
      <h3>Time to an answer</h3>
      <Plot what={ROUND_TRIP} data={data} span={SPAN} />
      <Facts class="list" of={[["Firmware", robot.scheme.value?.firmware || "?"], ...(link ? rows(link) : [])]} />
    </div>
  );
}
