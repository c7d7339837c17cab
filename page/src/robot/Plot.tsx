// Curves over time. uPlot draws them, and is loaded when the first ones are shown.
import { computed, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type UPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { inks } from "../look/canvas";
import { number } from "../look/text";
import { isDark } from "../look/theme";
import type { Instrument } from "../messages";
import type { Moment } from "../store";

export type Choice = Omit<Instrument, "absent">;
export type Columns = { times: number[]; values: (number | null)[][] };

const NO_RANGE = { low: null, high: null, physical_unit: "" };
export const WHEELS = {
  ...{ name: "~wheels", title: "Wheels, as commanded", labels: ["left", "right"], units: ["rev/s", "rev/s"] },
  ...NO_RANGE,
};
export const ROUND_TRIP = { name: "~latency", title: "Round trip", labels: ["median"], units: ["ms"], ...NO_RANGE };

const LEAST: Record<string, number> = { counts: 20, "rev/s": 0.1, g: 0.1, ms: 5, T: 1e-6 }; // a scale's, by unit
const GAP = 1; // s without news after which a curve is interrupted
const STEPS = [1, 2, 5, 10, 20, 30, 60, 120]; // s between two lines
const NONE: number[] = [];
const FONT = "12px Inter Variable, sans-serif";

const uPlot = signal<typeof UPlot | null>(null);
const CURVES = ["curve-0", "curve-1", "curve-2", "curve-3", "curve-4", "curve-5", "curve-6", "curve-7"];
const ink = computed(() => (isDark(), inks("line", "faint", ...CURVES)));

const valuesOf = ({ name }: Choice, { values, wheels, latency }: Moment) =>
  name === WHEELS.name ? wheels : name === ROUND_TRIP.name ? [latency === null ? null : 1000 * latency] : values[name];

/** The unit of all values; empty if they have several. */
export const unitOf = ({ units }: Choice) => (units.every((each) => each === units[0]) ? (units[0] ?? "") : "");

/** The newest *span* seconds: a column of times, which end at 0, and one for each value. */
export function columns(what: Choice, history: Moment[], span: number): Columns {
  const last = history.at(-1)?.time ?? 0,
    times: number[] = [],
    values: Columns["values"] = what.labels.map(() => []);
  const add = (time: number, found?: (number | null)[]) => {
    times.push(time - last);
    values.forEach((column, k) => column.push(found?.[k] ?? null));
  };
  let before = Infinity;
  for (const moment of history.slice(
    Math.max(
      0,
      history.findIndex(({ time }) => time >= last - span),
    ),
  )) {
    if (moment.time - before > GAP) add(moment.time - 0.001);
    add(moment.time, valuesOf(what, moment));
    before = moment.time;
  }
  return { times, values };
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
  const { what, data, span, isFitted, hidden = NONE } = props;
  const box = useRef<HTMLDivElement>(null),
    plot = useRef<UPlot>(null),
    now = useRef(props);
  now.current = props;
  useEffect(() => {
    if (!uPlot.value) return void import("uplot").then((loaded) => (uPlot.value = loaded.default));
    const made = (plot.current = new uPlot.value(options(what, now, box.current!), [[]], box.current!));
    const watch = new ResizeObserver(() =>
      made.setSize({ width: box.current!.clientWidth, height: box.current!.clientHeight }),
    );
    watch.observe(box.current!);
    return () => (watch.disconnect(), made.destroy());
  }, [uPlot.value]);
  useEffect(() => {
    const { current } = plot;
    current?.batch(() => {
      what.labels.forEach((_, k) => current.setSeries(k + 1, { show: !hidden.includes(k) }));
      current.setData([data.times, ...data.values]);
    });
  }, [uPlot.value, data, span, isFitted, hidden, isDark()]);
  return <div class="plot" ref={box} role="img" aria-label={`chart of ${what.title}`} />;
}

function options(what: Choice, now: { current: Props }, { clientWidth, clientHeight }: Element): UPlot.Options {
  const grid = { stroke: () => ink.value.line, width: 1 },
    axis = { stroke: () => ink.value.faint, font: FONT, grid, ticks: { show: false }, gap: 6 };
  let grown: [low: number, high: number] | null = null;
  /** The instrument's own ends, unless a person wants what is shown enlarged; otherwise what has been seen so far. */
  const range = (low: number | null, high: number | null): [number, number] => {
    const isFixed = !now.current.isFitted;
    if (isFixed && !what.physical_unit && what.low !== null && what.high !== null) return [what.low, what.high];
    const ends = [low, high, ...(isFixed && grown ? grown : [])].filter((each) => each !== null),
      least = LEAST[what.units[0]] ?? 0.1;
    const [bottom, top] = ends.length ? [Math.min(...ends), Math.max(...ends)] : [0, least];
    if (isFixed && ends.length) grown = [bottom, top]; // it grows, and never shrinks under the eyes
    const room = Math.max(least - (top - bottom), 0.08 * (top - bottom)) / 2;
    return [bottom - room, top + room];
  };
  return {
    width: clientWidth,
    height: clientHeight,
    legend: { show: false },
    cursor: { y: false, drag: { x: false, y: false }, sync: { key: "charts" } },
    hooks: { setCursor: [({ cursor }) => now.current.point?.(cursor.idx ?? null)] },
    scales: {
      x: { time: false, range: () => [-now.current.span, 0] },
      y: { range: (_, low, high) => range(low, high) },
    },
    axes: [
      {
        ...axis,
        size: 24,
        space: 56,
        incrs: STEPS,
        values: (_, seconds) => seconds.map((each) => (each ? `${number(each)} s` : "now")),
      },
      {
        ...axis,
        size: 46,
        space: 24,
        label: unitOf(what),
        labelSize: 18,
        labelFont: FONT,
        values: (_, values, __, ___, step) =>
          values.map((each) => number(each, Math.max(0, -Math.floor(Math.log10(step))))),
      },
    ],
    series: [
      {},
      ...what.labels.map((label, k) => ({
        label,
        stroke: () => ink.value[CURVES[k % CURVES.length]],
        width: 2,
        points: { show: false },
      })),
    ],
  };
}
