// Curves over time.
import { computed } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { AlignedData } from "uplot";
import { inks } from "../look/canvas";
import { FONT, usePlot, type Options } from "../look/plot";
import { number } from "../look/text";
import { isDark } from "../look/theme";
import type { Instrument } from "../messages";
import type { Moment } from "../store";
import "./charts.css";

/** What can be shown; its unit is empty if its values have several. */
export type Choice = Omit<Instrument, "absent" | "physical_unit"> & { unit: string };
type Columns = { times: number[]; values: (number | null)[][] };

const own = (name: string, title: string, labels: string[], unit: string): Choice => {
  return { name, title, labels, unit, units: labels.map(() => unit), low: null, high: null };
};
export const WHEELS = own("~wheels", "Wheels, as commanded", ["left", "right"], "rev/s");
export const ROUND_TRIP = own("~latency", "Round trip", ["median"], "ms");

const LEAST: Record<string, number> = { counts: 20, "rev/s": 0.1, g: 0.1, ms: 5, T: 1e-6 }; // a scale's, by unit
const QUIET = 0.2; // of a scale that starts at 0 is shown of values that are small
const GAP = 1; // s without news after which a curve is interrupted
const SECONDS = [1, 2, 5, 10, 20, 30, 60, 120]; // between two lines

const CURVES = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => `curve-${k}`);
const ink = computed(() => (isDark(), inks("card", "line", "faint", ...CURVES)));

function valuesOf({ name }: Choice, { values, wheels, latency }: Moment) {
  if (name === ROUND_TRIP.name) return [latency && 1000 * latency];
  return name === WHEELS.name ? wheels : values[name];
}

/** The newest *span* seconds: a column of times, which end at 0, and one for each value. */
export function columns(what: Choice, history: Moment[], span: number): Columns {
  const last = history.at(-1)?.time ?? 0,
    found: Columns = { times: [], values: what.labels.map(() => []) };
  const add = (time: number, values?: (number | null)[]) => {
    found.times.push(time - last);
    found.values.forEach((column, k) => column.push(values?.[k] ?? null));
  };
  let before = Infinity;
  for (const moment of history.slice(history.findIndex(({ time }) => time >= last - span))) {
    if (moment.time - before > GAP) add(moment.time - 0.001);
    add(moment.time, valuesOf(what, moment));
    before = moment.time;
  }
  return found;
}

type Props = {
  what: Choice;
  data: Columns;
  span: number;
  isFitted?: boolean;
  hidden?: number[];
  /** Told the row of the data under the mouse. */
  point?: (row: number | null) => void;
};

/** Curves; give another key with another *what*. */
export function Plot(props: Props) {
  const { what, data, span, isFitted, hidden } = props;
  const box = useRef<HTMLDivElement>(null),
    now = useRef(props);
  now.current = props;
  const aligned = useMemo<AlignedData>(() => [data.times, ...data.values], [data, span, isFitted, hidden, isDark()]),
    plot = usePlot(box, () => options(what, now), aligned, []);
  useEffect(() => {
    what.labels.forEach((_, k) => plot.current?.setSeries(k + 1, { show: !hidden?.includes(k) }));
  }, [plot.current, hidden]);
  return <div class="plot" ref={box} role="img" aria-label={`chart of ${what.title}`} />;
}

function options(what: Choice, now: { current: Props }): Options {
  const line = { stroke: () => ink.value.line, width: 1 },
    axis = { stroke: () => ink.value.faint, font: FONT, labelFont: FONT, grid: line, ticks: { show: false }, gap: 6 };
  let seen: [low: number, high: number] | null = null;
  /** What has been seen so far, with the instrument's own lower end; what is shown now if a person wants it enlarged. */
  const range = (low: number | null, high: number | null): [number, number] => {
    const isFixed = !now.current.isFitted,
      least = LEAST[what.unit] ?? 0.1,
      ends = [low, high, ...((isFixed && seen) || [])].filter((each) => each !== null),
      [bottom, top] = ends.length ? [Math.min(...ends), Math.max(...ends)] : [0, least];
    if (isFixed && ends.length) seen = [bottom, top]; // it grows, and never shrinks under the eyes
    if (isFixed && what.low !== null && what.high !== null)
      return [what.low, what.low < 0 ? what.high : Math.min(what.high, Math.max(1.2 * top, QUIET * what.high))];
    const room = Math.max(least - (top - bottom), 0.08 * (top - bottom)) / 2;
    return [bottom - room, top + room];
  };
  const digits = (step: number) => Math.max(0, -Math.floor(Math.log10(step)));
  const ago = (seconds: number) => (seconds ? `${number(seconds)} s` : "now");
  return {
    cursor: { y: false, drag: { x: false }, sync: { key: "charts" } },
    hooks: {
      setCursor: [({ cursor }) => now.current.point?.(cursor.idx ?? null)],
      drawClear: [
        ({ ctx }) => {
          ctx.fillStyle = ink.value.card; // otherwise a picture that is saved would be transparent
          ctx.fillRect(0, 0, ctx.canvas.width, ctx.canvas.height);
        },
      ],
    },
    scales: {
      x: { time: false, range: () => [-now.current.span, 0] },
      y: { range: (_, low, high) => range(low, high) },
    },
    axes: [
      { ...axis, size: 24, space: 56, incrs: SECONDS, values: (_, all) => all.map(ago) },
      {
        ...{ ...axis, size: 46, space: 24, label: what.unit, labelSize: 18 },
        values: (_, all, __, ___, step) => all.map((each) => number(each, digits(step))),
      },
    ],
    series: [
      {},
      ...what.labels.map((_, k) => ({ stroke: () => ink.value[CURVES[k % 8]], width: 2, points: { show: false } })),
    ],
  };
}
