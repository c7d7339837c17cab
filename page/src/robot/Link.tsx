// How good the link is: how long answers take, and what was lost.
import { CircleCheck, TriangleAlert, Unplug } from "lucide";
import { useMemo } from "preact/hooks";
import { Icon } from "../look/Icon";
import { age, milliseconds, number } from "../look/text";
import type { LinkStats } from "../messages";
import type { Robot } from "../store";
import { columns, Plot, ROUND_TRIP } from "./Plot";
import { SLOW } from "./Status";
import "./lists.css";

const SPAN = 60; // s of the chart
const ROWS: [title: string, text: (link: LinkStats) => string][] = [
  ["Time to an answer, usually", ({ median }) => milliseconds(median)],
  ["Time to an answer, 99 of 100", ({ p99 }) => milliseconds(p99)],
  ["Commands without an answer", ({ loss, lost }) => (loss === null ? "?" : `${lost} (${number(100 * loss, 1)} %)`)],
  ["Last answer", (link) => (link.age === null ? "?" : `${age(link.age)} ago`)],
  ["Answers received", ({ count }) => String(count)],
  ["Commands that wait", ({ waiting }) => String(waiting)],
  ["Commands that the robot did not know", ({ refused }) => String(refused)],
  ["Commands given up before they were sent", ({ unsent }) => String(unsent)],
  ["Order of answers restored", ({ resyncs }) => `${resyncs} times`],
  ["Restarts of the robot", ({ resets }) => String(resets)],
];

/** How good a link is, in a sentence. */
function Verdict({ link }: { link: LinkStats }) {
  const { median, loss, lost } = link;
  if (median === null) return <p>No answer has come yet.</p>;
  const isGood = median < SLOW && (loss ?? 0) < 0.01;
  return (
    <p class={`row ${isGood ? "good" : "warn"}`}>
      <Icon of={isGood ? CircleCheck : TriangleAlert} />
      {`The link is ${isGood ? "good" : "poor"}: answers take ${milliseconds(median)}, ` +
        `${lost ? `${lost} were lost` : "nothing lost"}.`}
    </p>
  );
}

export function Link({ robot }: { robot: Robot }) {
  const tick = robot.tick.value,
    link = tick?.link,
    isOn = tick?.phase === "connected",
    data = useMemo(() => columns(ROUND_TRIP, robot.history, SPAN), [tick]);
  return (
    <div class={`stack link ${isOn ? "" : "stale"}`}>
      {link && isOn ? (
        <Verdict link={link} />
      ) : (
        <p class="row">
          <Icon of={Unplug} />
          Not connected.
        </p>
      )}
      <h3>Time to an answer</h3>
      <Plot what={ROUND_TRIP} data={data} span={SPAN} />
      <dl>
        <dt>Firmware</dt>
        <dd>{robot.scheme.value?.firmware || "?"}</dd>
        {ROWS.map(([title, text]) => (
          <>
            <dt>{title}</dt>
            <dd>{link ? text(link) : "?"}</dd>
          </>
        ))}
      </dl>
    </div>
  );
}
