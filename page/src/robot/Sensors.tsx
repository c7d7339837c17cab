// What the robot sees, as a drawing, and every reading with its age: in a common unit, and in the robot's own beside it.
import { age, DIGITS, number } from "../look/text";
import type { Instrument, Reading } from "../messages";
import type { Robot } from "../store";
import { Body } from "./Body";
import { isOff } from "./Status";
import "./Sensors.css";

const MAX_ROWS = 5; // more values stand side by side
const UNITS: Record<string, string> = { "degrees C": "°C" };

type Conversion = [factor: number, unit: string, digits: number];
type Picture = (reading: Reading, instrument: Instrument) => preact.ComponentChild;

const clamped = (value: number) => Math.max(0, Math.min(1, value));

/** A bar for each value. */
const Bars: Picture = ({ values }, { low, high }) =>
  values?.map((value, k) => {
    const y = 28 + (k - (values.length - 1) / 2) * Math.min(14, 56 / values.length),
      share = value === null ? 0 : clamped((Number(value) - (low ?? 0)) / ((high ?? 4095) - (low ?? 0)));
    return (
      <g key={k} transform={`translate(3 ${y})`} stroke-width={7}>
        <path stroke="var(--line)" d="M0,0H50" />
        {share > 0 && <path stroke="var(--accent)" d={`M0,0H${50 * share}`} />}
      </g>
    );
  });

/** The bubble goes to the side that is up, and lies in the middle of a robot that stands level. */
const Bubble: Picture = ({ physical }) => {
  const [x, y, z] = physical?.every((each) => each !== null) ? (physical as number[]) : [0, 0, 1],
    far = Math.max(0.3, Math.hypot(x, y, z));
  return (
    <g transform="translate(28 28)">
      <circle fill="var(--card)" r={27} />
      <path d="M-27,0H27M0,-27V27" />
      <g fill={`var(--${z < 0 ? "bad" : "good"})`} stroke="none">
        <circle r={7} cx={(-20 * x) / far} cy={(20 * y) / far} />
      </g>
    </g>
  );
};

/** Sixteen positions. */
const Dial: Picture = ({ values }) => (
  <g transform="translate(28 28)">
    {Array.from({ length: 16 }, (_, k) => (
      <path key={k} d="M0,-26V-21" transform={`rotate(${22.5 * k})`} />
    ))}
    <g stroke="var(--accent)" stroke-width={4}>
      <path d="M0,4V-18" transform={`rotate(${22.5 * Number(values?.[0] ?? 0)})`} />
    </g>
  </g>
);

const PICTURES: Record<string, Picture> = { accelerometer: Bubble, microphones: Bars, ground: Bars, selector: Dial };

/** A value as it is written, and the robot's own number beside it if that is another. */
function written(
  value: number | boolean | null,
  unit: string,
  physical: number | null,
  name: string,
  other?: Conversion,
) {
  const digits = Number.isInteger(value) && unit !== "rev/s" ? 0 : (DIGITS[unit] ?? 0),
    own = typeof value === "boolean" ? (value ? "yes" : "no") : number(value, digits),
    raw = value === null ? "" : `${own} ${UNITS[unit] ?? unit}`;
  if (name) return [number(physical, DIGITS[name] ?? 1), name, raw];
  if (!other) return [own, UNITS[unit] ?? unit, ""];
  return [typeof value === "number" ? number(other[0] * value, other[2]) : "?", other[1], raw];
}

type Props = { about: Instrument; reading: Reading; converted: Record<string, Conversion> };

function Tile({ about, reading, converted }: Props) {
  const { name, title, labels, units, physical_unit } = about,
    { values, physical, age: old, stale } = reading,
    isRing = labels.length > MAX_ROWS,
    isKnown = values?.some((value) => value !== null),
    isKeyless = name === "ir_receiver" && Number(values?.[0]) > 1, // a toggle bit is 0 or 1
    hasPicture = name in PICTURES,
    isWide = isRing || hasPicture || physical_unit || units.some((unit) => unit in converted),
    note = isKeyless
      ? "no key yet"
      : isKnown && (old ?? 0) > 1
        ? `${age(old)} old`
        : values && !isKnown
          ? "no value"
          : "";
  return (
    <section class={`tile well ${isWide ? "wide" : ""} ${stale ? "stale" : ""}`} aria-label={title}>
      <h3 class="row">
        {isRing ? `${title}, ${units[0]}` : title} <span class="fill" />
        <span class="hint age">{note}</span>
      </h3>
      <div class="row">
        {hasPicture && (
          <svg class="picture" viewBox="0 0 56 56" aria-hidden="true">
            {PICTURES[name](reading, about)}
          </svg>
        )}
        <div class={isRing ? "fill values ring columns" : "fill values"}>
          {!isKeyless &&
            labels.slice(0, values?.length).map((label, k) => {
              const [text, unit, raw] = written(
                values?.[k] ?? null,
                units[k],
                physical?.[k] ?? null,
                physical_unit,
                converted[units[k]],
              );
              // A value of a sensor around the robot is named as in the drawing of it, and as in programs.
              return (
                <p key={k}>
                  <i>{isRing ? `IR${k} ${label}` : label}</i>
                  <b>{text}</b>
                  {!isRing && <u>{unit}</u>}
                  {raw && <span>{raw}</span>}
                </p>
              );
            })}
        </div>
      </div>
    </section>
  );
}

const UNKNOWN: Reading = { values: null, physical: null, age: null, stale: true };

export function Sensors({ robot }: { robot: Robot }) {
  const tick = robot.tick.value,
    scheme = robot.scheme.value;
  if (!tick || !scheme) return null;
  const { instruments, circumference, firmware } = scheme,
    absent = instruments.filter((each) => each.absent),
    readingOf = (name: string) => tick.readings[name] ?? UNKNOWN,
    isPlayed = isOff(robot) || tick.phase === "playing" || tick.phase === "watched", // readings may be missing
    shown = instruments.filter((each) => !each.absent && !(isPlayed && !readingOf(each.name).values)),
    converted: Record<string, Conversion> = {
      "rev/s": [100 * circumference, "cm/s", 1],
      steps: [circumference / 10, "cm", 1], // a turn has 1000 steps
      rad: [180 / Math.PI, "°", 0],
      T: [1e6, "µT", 1],
    };
  if (isOff(robot) && !shown.some(({ name }) => readingOf(name).values))
    return <p class="hint">Nothing is read while the robot is not connected.</p>;
  return (
    <>
      <Body robot={robot} sensors />
      <p class="hint">
        Orange: how far each infrared sensor looks freely. The numbers are counts: with nothing near, each sensor has a
        number of its own; it grows when something comes near. Yellow: light.{" "}
        {!isPlayed && "The circles are LEDs: click one to switch it."}
      </p>
      <div class="instruments columns">
        {shown.map((each) => (
          <Tile key={each.name} about={each} reading={readingOf(each.name)} converted={converted} />
        ))}
      </div>
      {absent.length > 0 && firmware && (
        <details class="absent">
          <summary>Not on this robot: {absent.length} sensors</summary>
          {absent.map(({ name, title, absent: why }) => (
            <p class="hint" key={name}>
              <b>{title}</b>: {why}
            </p>
          ))}
        </details>
      )}
    </>
  );
}
