// A robot among many: what it sees around it, how it is, and what is done with it alone.
import { Lightbulb, Square } from "lucide";
import { Button } from "../look/Button";
import type { Listed, Summary } from "../messages";
import { address } from "../route";
import { can, hello, listed, robotOf } from "../store";

const LOW = 0.2; // of the battery, from which on it is worth a word
const SLOW = 0.3; // s until an answer, from which on it is worth a word
const NEAR = 0.03; // m to something that a robot is about to touch

type AroundProps = { number: number; distances: Summary["distances"]; isOld: boolean };

/** A robot, with its number and colour in the world, ahead is up; an arc for each sensor that sees something. */
function Around({ number, distances, isOld }: AroundProps) {
  const { sensors } = hello.value!.ring;
  return (
    <svg class={isOld ? "icon stale" : "icon"} viewBox="-27 -27 54 54" width={48} fill="none" aria-hidden="true">
      {distances.map((metres, sensor) => {
        if (metres === null) return null;
        const turn = -90 - (180 / Math.PI) * sensors[sensor],
          radius = 16 + Math.min(12, 100 * metres);
        return (
          <path
            key={sensor}
            stroke={`var(--${metres < NEAR ? "bad" : "accent"})`}
            stroke-width={3}
            d={`M ${radius} ${-0.17 * radius} A ${radius} ${radius} 0 0 1 ${radius} ${0.17 * radius}`}
            transform={`rotate(${turn})`}
          />
        );
      })}
      <circle r="13" fill={`var(--curve-${number % 8})`} />
      <text y="1" fill="var(--card)" font-size="13" font-weight="700" text-anchor="middle" dominant-baseline="middle">
        {number + 1}
      </text>
    </svg>
  );
}

/** What is worth a word: that all is well needs none in each of twenty cards. */
const words = ({ phase, phase_text, behaviour, error, driver, median, battery }: Summary) =>
  (phase === "connected"
    ? [
        behaviour,
        driver && "driven by a person",
        median !== null && median >= SLOW && `slow: ${Math.round(1000 * median)} ms`,
        battery !== null && battery <= LOW && `battery ${Math.round(100 * battery)} %`,
      ]
    : [phase_text, error]
  )
    .filter(Boolean)
    .join(" · ");

export function Card({ robot: { key, label, url }, summary }: { robot: Listed; summary: Summary }) {
  const robot = robotOf(key),
    { phase, phase_text, may_move } = summary,
    isBad = phase === "failed" || phase === "gap",
    told = words(summary);
  return (
    <article class="robot-card row" aria-label={label}>
      <Around
        number={listed.value.findIndex((each) => each.key === key)}
        distances={summary.distances}
        isOld={summary.stale}
      />
      <div class="fill">
        <a class="short" href={address(key)} title={url}>
          {label}
        </a>
        <p class={`small short ${isBad ? "bad" : ""}`} data-phase={phase} title={told || phase_text}>
          {told || (may_move ? "moves" : "stands")}
        </p>
      </div>
      {can().drive && (
        <>
          <Button weight="quiet" icon={Lightbulb} label={`let ${label} blink`} act={() => robot.ask("blink", {})} />
          <Button
            weight="quiet"
            class={may_move ? "bad" : ""}
            icon={Square}
            label={`stop ${label}`}
            act={() => robot.tell("stop", {})}
          />
        </>
      )}
    </article>
  );
}
