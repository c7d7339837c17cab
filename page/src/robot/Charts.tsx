// Charts of any reading: all show the same time, can be paused and zoomed, and are saved as tables and pictures.
import { signal, useSignal, type Signal } from "@preact/signals";
import { Pause, Play, Plus, UnfoldVertical, X, ZoomIn, ZoomOut } from "lucide";
import { useMemo, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { inks } from "../look/canvas";
import { DIGITS, number, save } from "../look/text";
import type { Moment, Robot } from "../store";
import { columns, Plot, ROUND_TRIP, unitOf, WHEELS, type Choice } from "./Plot";
import { kept } from "./kept";
import "./charts.css";

const SPANS = [5, 10, 20, 60, 120, 300]; // s
const MOST = 6;

/** One chart, as a person set it. */
class Setting {
  readonly name: Signal<string>;
  readonly hidden = signal<number[]>([]);
  readonly isFitted = signal(false);
  constructor(name: string) {
    this.name = signal(name);
  }
}

const stateOf = kept(() => ({
  charts: signal([new Setting("proximity"), new Setting("speed")]),
  span: signal(20),
  paused: signal<Moment[] | null>(null),
}));

/** What a chart of a robot can show. */
function choicesOf(robot: Robot): Choice[] {
  const known = robot.scheme.value?.instruments.filter(({ absent }) => !absent) ?? [];
  const converted = known.map((each) =>
    each.physical_unit ? { ...each, units: each.labels.map(() => each.physical_unit) } : each,
  );
  return [...converted, WHEELS, ROUND_TRIP];
}

function Chart({ robot, setting, remove }: { robot: Robot; setting: Setting; remove: () => void }) {
  const { name, hidden, isFitted } = setting,
    { span, paused } = stateOf(robot),
    row = useSignal<number | null>(null),
    box = useRef<HTMLElement>(null);
  const scheme = robot.scheme.value,
    choices = useMemo(() => choicesOf(robot), [scheme]),
    what = choices.find((each) => each.name === name.value) ?? choices[0];
  const news = robot.tick.value,
    history = paused.value ?? robot.history,
    data = useMemo(() => columns(what, history, span.value), [what, history, span.value, paused.value ?? news]);

  const toggle = (k: number) =>
    (hidden.value = hidden.value.includes(k) ? hidden.value.filter((each) => each !== k) : [...hidden.value, k]);
  const saveTable = () => {
    const names = what.labels.map((label, k) => `${label} ${what.units[k] ?? ""}`.trim()),
      { times, values } = data;
    const rows = times.map((time, at) => [time.toFixed(3), ...values.map((column) => column[at] ?? "")]);
    const text = [["seconds", ...names], ...rows].map((each) => each.join(",")).join("\n");
    save(new Blob([`${text}\n`], { type: "text/csv" }), `${what.name}.csv`);
  };
  const savePicture = () => {
    const drawn = box.current!.querySelector("canvas")!,
      picture = Object.assign(document.createElement("canvas"), { width: drawn.width, height: drawn.height }),
      pen = picture.getContext("2d")!;
    pen.fillStyle = inks("card").card;
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.drawImage(drawn, 0, 0);
    picture.toBlob((blob) => blob && save(blob, `${what.name}.png`));
  };
  return (
    <section class="chart" ref={box} aria-label={`chart: ${what.title}`}>
      <div class="row">
        <select
          class="fill"
          aria-label="what the chart shows"
          value={what.name}
          onChange={(event) => ((name.value = event.currentTarget.value), (hidden.value = []))}
        >
          {choices.map((each) => (
            <option key={each.name} value={each.name}>
              {each.title}
            </option>
          ))}
        </select>
        <Button weight="quiet" title="save what is shown as a table" act={saveTable}>
          CSV
        </Button>
        <Button weight="quiet" title="save what is shown as a picture" act={savePicture}>
          PNG
        </Button>
        <Button
          weight="quiet"
          icon={UnfoldVertical}
          label="fit height: stretch what is shown to the whole height"
          aria-pressed={isFitted.value}
          act={() => (isFitted.value = !isFitted.value)}
        />
        <Button weight="quiet" icon={X} label="remove this chart" act={remove} />
      </div>
      <Plot
        key={`${what.name} ${scheme?.scheme}`}
        {...{ what, data, span: span.value, isFitted: isFitted.value, hidden: hidden.value }}
        point={(at) => (row.value = at)}
      />
      <div class="curves">
        {what.labels.map((label, k) => {
          const value = data.values[k].at(row.value ?? -1) ?? null,
            unit = what.units[k] ?? "",
            digits = Number.isInteger(value) && unit === "counts" ? 0 : (DIGITS[unit] ?? 2);
          return (
            <label key={label} class="check" style={{ "--hue": `var(--curve-${k % 8})` }}>
              <input type="checkbox" checked={!hidden.value.includes(k)} onChange={() => toggle(k)} />
              <span class="fill">{label || what.title}</span>
              <output>{`${number(value, digits)} ${unitOf(what) ? "" : unit}`}</output>
            </label>
          );
        })}
      </div>
    </section>
  );
}

export function Charts({ robot }: { robot: Robot }) {
  const { charts, span, paused } = stateOf(robot);
  const zoom = (by: number) =>
    (span.value = SPANS[Math.max(0, Math.min(SPANS.length - 1, SPANS.indexOf(span.value) + by))]);
  const wheel = (event: WheelEvent) => {
    if (!event.ctrlKey) return;
    event.preventDefault(); // otherwise the browser enlarges the page
    zoom(Math.sign(event.deltaY));
  };
  return (
    <div class="charts" onWheel={wheel}>
      <div class="row">
        <Button
          icon={paused.value ? Play : Pause}
          act={() => (paused.value = paused.value ? null : robot.history.slice())}
        >
          {paused.value ? "Continue charts" : "Pause charts"}
        </Button>
        <span class="fill" />
        <Button weight="quiet" icon={ZoomOut} label="show a longer time" act={() => zoom(1)} />
        <output>{span.value < 60 ? `${span.value} s` : `${span.value / 60} min`}</output>
        <Button weight="quiet" icon={ZoomIn} label="show a shorter time" act={() => zoom(-1)} />
      </div>
      {charts.value.map((setting) => (
        <Chart
          key={setting}
          robot={robot}
          setting={setting}
          remove={() => (charts.value = charts.value.filter((each) => each !== setting))}
        />
      ))}
      {charts.value.length < MOST && (
        <Button weight="quiet" icon={Plus} act={() => (charts.value = [...charts.value, new Setting("accelerometer")])}>
          Add a chart
        </Button>
      )}
    </div>
  );
}
