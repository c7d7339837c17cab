// Behaviours: chosen, set, started, paused and ended, with what a running one does and says, and its source text.
import { signal, useSignal } from "@preact/signals";
import { Code2, Pause, Play, Square } from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Code } from "../look/Code";
import { number } from "../look/text";
import type { BehaviourOption, Play as State } from "../messages";
import { ask, can, hello, listed, type Robot } from "../store";
import { kept } from "./kept";
import "./lists.css";

const COLOURS: Partial<Record<State["phase"], string>> = { running: "connected", paused: "gap", failed: "failed" };

const stateOf = kept(() => ({
  name: signal("avoid"),
  typed: signal<Record<string, string>>({}), // by the names of behaviour and option
  isSource: signal(false),
}));

/** How the behaviour stands, and what it said. */
function Doing({ play, isSource }: { play: State; isSource: boolean }) {
  const { name, phase, phase_text, state, reason, error, time, lines } = play,
    log = useRef<HTMLDivElement>(null);
  useEffect(() => log.current?.scrollTo(0, log.current.scrollHeight), [lines]);
  const doing = ["running", "paused"].includes(phase)
    ? [state && `state: ${state}`, reason, `${number(time, 1)} s`]
    : [name && `ran ${number(time, 1)} s`, state && `last state: ${state}`];
  return (
    <>
      <div class="row wrap play">
        <p class="chip" role="status" data-phase={COLOURS[phase]}>
          {name ? `${name}: ${phase_text}` : "No behaviour has run yet."}
        </p>
        <span class="hint">{doing.filter(Boolean).join(" · ")}</span>
      </div>
      {error && (
        <p class="alarm" role="alert">
          {error}
        </p>
      )}
      {!isSource && lines.length > 0 && (
        <div class="lines" ref={log} tabIndex={0} role="log" aria-label="what the behaviour says" data-keys="">
          {lines.map(([seconds, text]) => (
            <p class="event">
              <time>{number(seconds, 1)} s</time>
              <span class="fill">{text}</span>
            </p>
          ))}
        </div>
      )}
    </>
  );
}

function Source({ name }: { name: string }) {
  const text = useSignal<string | null>(null);
  useEffect(() => {
    let isShown = true;
    text.value = null;
    void ask("source", { name }).then((found) => isShown && (text.value = found ?? ""));
    return () => {
      isShown = false;
    };
  }, [name]);
  return text.value === null ? <p class="hint">Loading …</p> : <Code text={text.value} label={`source of ${name}`} />;
}

function Option({ of, value, set }: { of: BehaviourOption; value: string; set: (text: string) => void }) {
  const { name, unit, low, high, whole, rule } = of;
  const field = {
    placeholder: rule,
    value,
    onInput: ({ currentTarget }: { currentTarget: HTMLInputElement }) => set(currentTarget.value),
  };
  return (
    <label class="field" title={rule}>
      {unit ? `${name}, ${unit}` : name}
      {typeof of.default === "string" ? (
        <input type="text" {...field} />
      ) : (
        <input type="number" min={low ?? undefined} max={high ?? undefined} step={whole ? 1 : "any"} {...field} />
      )}
    </label>
  );
}

export function Behaviours({ robot }: { robot: Robot }) {
  const { name, typed, isSource } = stateOf(robot),
    form = useRef<HTMLDivElement>(null),
    play = robot.play.value,
    known = hello.value?.behaviours ?? [],
    groups = [...new Set(known.map(({ group }) => group))],
    chosen = known.find((each) => each.name === name.value) ?? known[0];
  if (!chosen || !play) return null;
  const isActive = play.phase === "running" || play.phase === "paused",
    isFree = !chosen.elsewhere && robot.tick.value?.phase === "connected";
  const valueOf = (option: BehaviourOption) =>
    typed.value[`${chosen.name} ${option.name}`] ?? `${option.default ?? ""}`;
  const start = (robots: string[]) => {
    if (![...(form.current?.querySelectorAll("input") ?? [])].every((field) => field.reportValidity())) return;
    const set = chosen.options.filter((option) => valueOf(option) !== "");
    const options = set.map((option) => {
      const value = valueOf(option);
      return [option.name, typeof option.default === "string" ? value : Number(value)];
    });
    return ask("behave", { robots, name: chosen.name, options: Object.fromEntries(options) });
  };
  const one = { robots: [robot.key] };
  return (
    <div class="stack grows behaviours">
      <div class="row">
        <select
          class="fill"
          aria-label="Behaviour"
          value={chosen.name}
          onChange={(event) => (name.value = event.currentTarget.value)}
        >
          {groups.map((group) => (
            <optgroup key={group} label={group}>
              {known
                .filter((each) => each.group === group)
                .map((each) => (
                  <option key={each.name}>{each.name}</option>
                ))}
            </optgroup>
          ))}
        </select>
        <Button
          weight="quiet"
          icon={Code2}
          aria-pressed={isSource.value}
          act={() => (isSource.value = !isSource.value)}
        >
          Source text
        </Button>
      </div>
      {isSource.value ? (
        <Source name={chosen.name} />
      ) : (
        <>
          <p class={chosen.elsewhere ? "warn" : "hint"}>
            {chosen.elsewhere
              ? `It cannot run here: ${chosen.elsewhere}.`
              : `${chosen.summary}${chosen.world && ` At home in sim://${chosen.world}.`}`}
          </p>
          <div class="options" ref={form}>
            {chosen.options.map((option) => (
              <Option
                key={`${chosen.name} ${option.name}`}
                of={option}
                value={valueOf(option)}
                set={(text) => (typed.value = { ...typed.value, [`${chosen.name} ${option.name}`]: text })}
              />
            ))}
          </div>
        </>
      )}
      {can().drive && (
        <div class="row wrap">
          {isActive ? (
            <>
              <Button
                weight="primary"
                icon={play.phase === "paused" ? Play : Pause}
                act={() => ask(play.phase === "paused" ? "resume_behaviour" : "pause_behaviour", one)}
              >
                {play.phase === "paused" ? "Continue behaviour" : "Pause behaviour"}
              </Button>
              <Button icon={Square} act={() => ask("end_behaviour", one)}>
                End behaviour
              </Button>
            </>
          ) : (
            <Button weight="primary" icon={Play} disabled={!isFree} act={() => start([robot.key])}>
              Start
            </Button>
          )}
          {listed.value.length > 1 && (
            <Button disabled={Boolean(chosen.elsewhere)} act={() => start(listed.value.map(({ key }) => key))}>
              Start for all robots
            </Button>
          )}
        </div>
      )}
      <Doing play={play} isSource={isSource.value} />
    </div>
  );
}
