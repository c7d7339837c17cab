// Behaviours: chosen, set, started, paused and ended, with what a running one does and says, and its source text.
import { signal, useSignal } from "@preact/signals";
import { Code2, Pause, Play, Square } from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Code } from "../look/Code";
import { number, title } from "../look/text";
import type { BehaviourAbout, Play as State } from "../messages";
import { ask, can, hello, listed, type Robot } from "../store";
import { kept } from "./kept";
import { Lines } from "./Lines";
import { States } from "./States";

const COLOURS: Partial<Record<State["phase"], string>> = { running: "connected", paused: "gap", failed: "failed" };

const stateOf = kept(() => ({
  name: signal("avoid"),
  typed: signal<Record<string, string>>({}), // by the names of behaviour and option
  isSource: signal(false),
}));

/** How the behaviour stands, and what it said. */
function Doing({ robot, play, isSource }: { robot: Robot; play: State; isSource: boolean }) {
  const { name, phase, phase_text, state, reason, error, time, lines } = play,
    isActive = phase === "running" || phase === "paused",
    passed = `${number(time, 1)} s`;
  const doing = isActive
    ? [state && `state: ${state}`, reason, passed]
    : [name && `ran ${passed}`, state && `last state: ${state}`];
  return (
    <>
      <div class="row wrap play">
        <p class="chip" role="status" data-phase={COLOURS[phase]} hidden={!name}>
          {`${title(name)}: ${phase_text}`}
        </p>
        <span class="hint">{doing.filter(Boolean).join(" · ")}</span>
      </div>
      <p class="alarm" role="alert" hidden={!error}>
        {error}
      </p>
      {!isSource && <States robot={robot} />}
      {!isSource && lines.length > 0 && (
        <Lines label="what the behaviour says" news={lines}>
          {lines.map(([seconds, text]) => (
            <p>
              <time>{number(seconds, 1)} s</time> {text}
            </p>
          ))}
        </Lines>
      )}
    </>
  );
}

function Source({ name }: { name: string }) {
  const text = useSignal("");
  useEffect(() => void ask("source", { name }).then((found) => (text.value = found ?? "")), []);
  return <Code text={text.value} label={`source text of ${name}`} />;
}

type OptionsProps = {
  chosen: BehaviourAbout;
  typed: string[];
  circumference: number; // of a wheel, m
  set: (k: number, text: string) => void;
};

/** The options of a behaviour as a form, with what a person typed or what the behaviour would take by itself. */
function Options({ chosen, typed, circumference, set }: OptionsProps) {
  return chosen.options.map(({ name, unit, low, high, whole, rule, default: value }, k) => {
    const field = { placeholder: rule, value: typed[k] },
      input = ({ currentTarget }: { currentTarget: HTMLInputElement }) => set(k, currentTarget.value),
      range = { min: low ?? undefined, max: high ?? undefined, step: whole ? 1 : "any" };
    return (
      <label key={name} class="field" title={rule}>
        {unit ? `${name}, ${unit}` : name}
        {unit === "rev/s" && typed[k] && ` (${number(100 * circumference * Number(typed[k]), 1)} cm/s)`}
        {typeof value === "string" ? (
          <input type="text" {...field} onInput={input} />
        ) : (
          <input type="number" {...field} {...range} onInput={input} />
        )}
      </label>
    );
  });
}

export function Behaviours({ robot }: { robot: Robot }) {
  const { name, typed, isSource } = stateOf(robot),
    form = useRef<HTMLDivElement>(null),
    known = hello.value?.behaviours ?? [],
    chosen = known.find((each) => each.name === name.value) ?? known[0],
    play = robot.play.value;
  if (!chosen || !play) return null;
  const { options, summary, world, elsewhere } = chosen,
    keyOf = (k: number) => `${chosen.name} ${options[k].name}`,
    texts = options.map((option, k) => typed.value[keyOf(k)] ?? String(option.default ?? ""));
  const start = (robots: string[]) => {
    if (![...(form.current?.querySelectorAll("input") ?? [])].every((field) => field.reportValidity())) return;
    const values = options.map((option, k) => [
      option.name,
      typeof option.default === "string" ? texts[k] : Number(texts[k]),
    ]);
    const set = values.filter((_, k) => texts[k] !== "");
    return ask("behave", { robots, name: chosen.name, options: Object.fromEntries(set) });
  };
  const one = { robots: [robot.key] },
    all = listed.value.map(({ key }) => key),
    isPaused = play.phase === "paused",
    isReady = !elsewhere && robot.tick.value?.phase === "connected";
  return (
    <div class="stack fill behaviours">
      <div class="row">
        <select
          class="fill"
          aria-label="Behaviour"
          value={chosen.name}
          onChange={({ currentTarget }) => (name.value = currentTarget.value)}
        >
          {[...new Set(known.map(({ group }) => group))].map((group) => (
            <optgroup label={group}>
              {known.map((each) => each.group === group && <option value={each.name}>{title(each.name)}</option>)}
            </optgroup>
          ))}
        </select>
        <Button
          weight="quiet"
          icon={Code2}
          aria-pressed={isSource.value}
          act={() => (isSource.value = !isSource.value)}
        >
          Show code
        </Button>
      </div>
      {isSource.value ? (
        <Source key={chosen.name} name={chosen.name} />
      ) : (
        <>
          {elsewhere && <p class="warn">{`It cannot run here: ${elsewhere}.`}</p>}
          <p class="hint">{`${summary}${world && ` At home in sim://${world}.`}`}</p>
          <div class="options columns" ref={form} key={chosen.name}>
            <Options
              chosen={chosen}
              typed={texts}
              circumference={robot.scheme.value?.circumference ?? 0}
              set={(k, text) => (typed.value = { ...typed.value, [keyOf(k)]: text })}
            />
          </div>
        </>
      )}
      {can().drive && (
        <div class="row wrap">
          {isPaused || play.phase === "running" ? (
            <>
              <Button
                weight="primary"
                icon={isPaused ? Play : Pause}
                act={() => ask(isPaused ? "resume_behaviour" : "pause_behaviour", one)}
              >
                {isPaused ? "Continue behaviour" : "Pause behaviour"}
              </Button>
              <Button icon={Square} act={() => ask("end_behaviour", one)}>
                End behaviour
              </Button>
            </>
          ) : (
            <Button weight="primary" icon={Play} disabled={!isReady} act={() => start(one.robots)}>
              Start
            </Button>
          )}
          {all.length > 1 && (
            <Button disabled={Boolean(elsewhere)} act={() => start(all)}>
              Start for all robots
            </Button>
          )}
        </div>
      )}
      <Doing robot={robot} play={play} isSource={isSource.value} />
    </div>
  );
}
