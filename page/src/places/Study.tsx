// The study that the page belongs to: the fitness of its generations, how far it is, and which controller drives.
import { signal, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type UPlot from "uplot";
import type { AlignedData } from "uplot";
import { inks } from "../look/canvas";
import { Facts, Select } from "../look/fields";
import { FONT, usePlot, type Options } from "../look/plot";
import { age, number, title } from "../look/text";
import { isDark } from "../look/theme";
import type { StudyAbout, StudyNews } from "../messages";
import { ask, study, subscribe } from "../store";
import "./Study.css";

const LEAST = 10; // generations that the axis has room for
const MOST = 2000; // points of a curve: no screen shows more
const FEW = 12; // of which each is drawn as a point
const BEGINS =
  "Many controllers are tried out; the best ones, a little changed, are the next generation. Before the first, the code is compiled: that can take a minute.";
const CURVES: [name: string, hue?: string][] = [
  ["best", "var(--ray)"],
  ["mean", "var(--trail)"],
  ["middle half", "color-mix(in srgb, var(--trail) 22%, transparent)"],
  ["lowest"],
];

type Generation = StudyNews["generations"][number]; // best, upper quarter, mean, lower quarter, lowest

// Kept while the page is open: the server tells each generation once.
const generations = signal<Generation[]>([]);
study.subscribe((news) => {
  if (!news || news.first > generations.peek().length) return; // of an earlier connection
  if (news.first < generations.peek().length || news.generations.length)
    generations.value = generations.peek().slice(0, news.first).concat(news.generations);
});

/** Best, mean and the band of the middle half over the generations; `point` is told which one the mouse points at. */
function Fitness({ count, point }: { count: number; point: (generation: number | null) => void }) {
  const box = useRef<HTMLDivElement>(null),
    done = generations.value;
  const data = useMemo(() => {
    const every = Math.ceil(done.length / MOST) || 1,
      drawn = done.map((each, k) => [k + 1, each[0], each[2], each[1], each[3]]).filter((_, k) => k % every === 0);
    return [0, 1, 2, 3, 4].map((row) => drawn.map((each) => each[row])) as AlignedData;
  }, [done]);
  const options = (): Options => {
    const { ray, trail, faint, grid } = inks("ray", "trail", "faint", "grid"),
      axis = {
        stroke: faint,
        grid: { stroke: grid, width: 1 },
        ticks: { show: false },
        labelSize: 16,
        font: FONT,
        labelFont: FONT,
      },
      points = { show: (plot: UPlot) => plot.data[0].length < FEW },
      edge = { stroke: "transparent", points: { show: false } };
    return {
      cursor: { y: false, drag: { x: false } },
      scales: { x: { time: false, range: (_, __, last) => [1, Math.max(Math.min(LEAST, count), last, 2)] } },
      axes: [
        { ...axis, label: "generation", size: 24, incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000] },
        { ...axis, label: "fitness", size: 44 },
      ],
      series: [{}, { stroke: ray, width: 2, points }, { stroke: trail, width: 2, points }, edge, edge],
      bands: [{ series: [3, 4], fill: `color-mix(in srgb, ${trail} 22%, transparent)` }],
      hooks: { setCursor: [({ cursor, data }) => point(cursor.idx == null ? null : data[0][cursor.idx])] },
    };
  };
  usePlot(box, options, data, [isDark(), count]);
  const text = `fitness of ${done.length} generations; the newest values stand below`;
  return <div ref={box} class="fitness" role="img" aria-label={text} />;
}

export function Study({ about }: { about: StudyAbout }) {
  const pointed = useSignal<number | null>(null);
  useEffect(() => subscribe({ what: "study", rate: 10 }), []);
  const news = study.value,
    done = generations.value,
    { bests = [], outcome = "" } = news ?? {},
    best = bests.at(-1),
    which = Math.min(pointed.value ?? done.length, done.length),
    told = done[which - 1]?.map((value) => number(value, 3)),
    controllers = bests.map(([from, fitness], k) => [k, `Generation ${from}: ${number(fitness, 3)}`] as const),
    values = told ? [told[0], told[2], `${told[3]} to ${told[1]}`, told[4]] : [];
  return (
    <section class="card stack study" aria-label="study">
      <h2>Study: {title(about.task)}</h2>
      <p>{about.summary}</p>
      <p class="how-far">
        <b>
          {outcome ||
            `${done.length} of ${about.count} generations${done.length ? ` · ${age(news?.left ?? 0)} left` : ""}`}
        </b>
      </p>
      <progress max={about.count} value={done.length} aria-label="generations done" />
      <p>
        {best
          ? `Best ${outcome ? "in the final test" : "so far"}: ${number(best[1], 3)}, of generation ${best[0]}`
          : news && BEGINS}
      </p>
      <Fitness count={about.count} point={(generation) => (pointed.value = generation)} />
      <div class="legend row wrap small">
        <b>{which > 0 && `Generation ${which}`}</b>
        {CURVES.map(([name, hue], k) => (
          <span key={name} style={hue && { "--hue": hue }}>
            {name} <b>{values[k]}</b>
          </span>
        ))}
      </div>
      <label class="field">
        Who drives
        <Select
          value={String(news?.chosen ?? "")}
          choices={[["", "Always the best so far"], ...controllers.reverse()]}
          choose={(value) => ask("choose_controller", { number: value === "" ? null : Number(value) })}
        />
      </label>
      {news?.shown && (
        <p class="hint">
          Now you see the best of generation {news.shown}, {about.seconds} s in each world.
        </p>
      )}
      <details>
        <summary>Settings</summary>
        <Facts of={Object.entries(about.settings)} />
      </details>
    </section>
  );
}
