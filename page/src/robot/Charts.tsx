// Charts of any reading: all show the same time, can be paused and zoomed, and are saved as tables and pictures.
import { signal, useSignal } from "@preact/signals";
import { Pause, Play, Plus, UnfoldVertical, X, ZoomIn, ZoomOut } from "lucide";
import { useMemo, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Check, Select } from "../look/fields";
import { DIGITS, number, save } from "../look/text";
import { hello, type Moment, type Robot } from "../store";
import { columns, Plot, ROUND_TRIP, WHEELS, type Choice } from "./Plot";
import { kept, toggled } from "./kept";

const SPANS = [5, 10, 20, 60, 120, 300]; // s
const MOST = 6;

const chartOf = (name: string) => ({ name: signal(name), hidden: signal<number[]>([]), isFitted: signal(false) });
const stateOf = kept(() => ({
  charts: signal([chartOf("proximity"), chartOf(WHEELS.name)]),
  span: signal(20),
  paused: signal<Moment[] | null>(null),
}));

/** What a chart of a robot can show: in a physical unit where there is one, which has no ends. */
function choicesOf(robot: Robot): Choice[] {
  const known = robot.scheme.value?.instruments.filter(({ absent }) => !absent) ?? [];
  const choices = known.map(({ physical_unit: unit, ...each }) => {
    if (unit) return { ...each, unit, units: each.labels.map(() => unit), low: null, high: null };
    return { ...each, unit: each.units.every((other) => other === each.units[0]) ? each.units[0] : "" };
  });
  return [...choices, WHEELS, ROUND_TRIP];
}

function Chart({ robot, chart, remove }: { robot: Robot; chart: ReturnType<typeof chartOf>; remove: () => void }) {
  const { name, hidden, isFitted } = chart,
    { span, paused } = stateOf(robot),
    row = useSignal<number | null>(null),
    box = useRef<HTMLElement>(null),
    scheme = robot.scheme.value,
    choices = useMemo(() => choicesOf(robot), [scheme]),
    what = choices.find((each) => each.name === name.value) ?? choices[0],
    isRing = what.labels.length === hello.value!.ring.sensors.length, // named as in the drawing of the robot
    shown = paused.value ?? robot.history,
    data = useMemo(() => columns(what, shown, span.value), [what, span.value, paused.value ?? robot.tick.value]);
  const saveTable = () => {
    const names = what.labels.map((label, k) => `${label} ${what.units[k]}`.trim());
    const rows = data.times.map((time, at) => [time.toFixed(3), ...data.values.map((column) => column[at] ?? "")]);
    const text = [["seconds", ...names], ...rows].map((each) => `${each.join(",")}\n`).join("");
    save(new Blob([text], { type: "text/csv" }), `${what.name}.csv`);
  };
  const savePicture = () =>
    box.current!.querySelector("canvas")!.toBlob((blob) => blob && save(blob, `${what.name}.png`));
  const choose = (chosen: string) => ((name.value = chosen), (hidden.value = []));
  return (
    <section class="stack chart" ref={box} aria-label={`chart: ${what.title}`}>
      <div class="row">
        <Select
          class="fill"
          aria-label="what the chart shows"
          value={what.name}
          choices={choices.map(({ name, title }) => [name, title])}
          choose={choose}
        />
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
      <div class="curves columns">
        {what.labels.map((label, k) => {
          const value = data.values[k].at(row.value ?? -1) ?? null,
            text = number(value, DIGITS[what.units[k]] ?? (Number.isInteger(value) ? 0 : 2)),
            toggle = () => (hidden.value = toggled(hidden.value, k));
          return (
            <Check style={{ "--hue": `var(--curve-${k % 8})` }} isOn={!hidden.value.includes(k)} act={toggle}>
              <span class="fill short">{isRing ? `IR${k} ${label}` : label || what.title}</span>
              <output>{`${text} ${what.unit ? "" : what.units[k]}`}</output>
            </Check>
          );
        })}
      </div>
    </section>
  );
}

export function Charts({ robot }: { robot: Robot }) {
  const { charts, span, paused } = stateOf(robot);
  const zoom = (by: number) => (span.value = SPANS[SPANS.indexOf(span.value) + by] ?? span.value);
  const wheel = (event: WheelEvent) => {
    if (!event.ctrlKey) return;
    event.preventDefault(); // otherwise the browser enlarges the page
    zoom(Math.sign(event.deltaY));
  };
  const pause = () => (paused.value = paused.value ? null : robot.history.slice());
  return (
    <div class="stack fill charts" onWheel={wheel}>
      <div class="row">
        <Button icon={paused.value ? Play : Pause} act={pause}>
          {paused.value ? "Continue charts" : "Pause charts"}
        </Button>
        <span class="fill" />
        <Button weight="quiet" icon={ZoomOut} label="show a longer time" act={() => zoom(1)} />
        <output>{span.value < 60 ? `${span.value} s` : `${span.value / 60} min`}</output>
        <Button weight="quiet" icon={ZoomIn} label="show a shorter time" act={() => zoom(-1)} />
      </div>
      {charts.value.map((chart) => (
        <Chart key={chart} {...{ robot, chart }} remove={() => (charts.value = toggled(charts.value, chart))} />
      ))}
      {charts.value.length < MOST && (
        <Button weight="quiet" icon={Plus} act={() => (charts.value = [...charts.value, chartOf("accelerometer")])}>
          Add a chart
        </Button>
      )}
    </div>
  );
}
