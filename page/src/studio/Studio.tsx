// The studio: on the left the program, with what it prints below it; on the right its world, and the lab that it is for.
import {
  ArrowDownToLine,
  ArrowUpFromLine,
  FlaskConical,
  Moon,
  Pause,
  Play,
  Redo2,
  Square,
  Sun,
  X,
  type IconNode,
} from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Dialog } from "../look/Dialog";
import { Select } from "../look/fields";
import { Icon } from "../look/Icon";
import { isDark, toggleTheme } from "../look/theme";
import { stop as stopAll } from "../stop";
import { closeToast, isSilent, toasts } from "../store";
import { useWorld } from "../world/live";
import { World } from "../world/World";
import { Editor } from "./editor";
import { isOpen as hasLabs, Labs } from "./Labs";
import { Output } from "./Output";
import { ProgramMenu } from "./ProgramMenu";
import * as programs from "./programs";
import { RobotMenu } from "./RobotMenu";
import * as run from "./run";
import { loading } from "./wire";
import "./studio.css";

const SPEEDS = [
  [0.25, "× ¼"],
  [0.5, "× ½"],
  [1, "× 1"],
  [2, "× 2"],
  [5, "× 5"],
  [0, "as fast as possible"],
] as const;
const STATES = { idle: "ready", running: "runs", paused: "paused" };
const COLOURS = { idle: undefined, running: "connected", paused: "gap" };

function Code() {
  const box = useRef<HTMLDivElement>(null),
    editor = useRef<Editor>(null),
    opened = programs.opened.value,
    program = run.program.value,
    chosen = run.shownLine.value;
  useEffect(() => {
    const root = box.current!.attachShadow({ mode: "open" }),
      told = { edit: programs.edit, points: (lines: number[]) => (run.breakpoints.value = lines) };
    editor.current = new Editor(root, "program; Tab indents, Escape and then Tab leaves the editor", told);
  }, []);
  useEffect(() => {
    editor.current!.open(opened.text);
    run.breakpoints.value = [];
  }, [opened]);
  useEffect(() => editor.current!.show(program), [program.state, program.line, program.mistake]);
  useEffect(() => void (chosen && editor.current!.lookAt(chosen.line, true)), [chosen]);
  return <div class="code well" ref={box} data-keys="" data-writes="" />;
}

/** What runs, where it stands, and what it waits for. */
function State() {
  const { state, time, line } = run.program.value,
    isLost = state === "running" && isSilent.value,
    words = loading.value
      ? `${loading.value.word} … ${Math.round(100 * loading.value.share)} %`
      : isLost
        ? "runs, and hears nothing"
        : STATES[state];
  return (
    <p class="chip" role="status" data-phase={loading.value || isLost ? "connecting" : COLOURS[state]}>
      {words}
      {state !== "idle" && <span class="time">{time.toFixed(1)} s</span>}
      {state === "paused" && line && <span>before line {line}</span>}
    </p>
  );
}

function Steps() {
  const { state } = run.program.value,
    isPaused = state === "paused";
  const step = (icon: IconNode, label: string, how: "over" | "into" | "out") => (
    <Button weight="quiet" {...{ icon, label }} disabled={!isPaused} act={() => run.goOn(how)} />
  );
  return (
    <div class="row" role="group" aria-label="pause and steps">
      {isPaused ? (
        <Button weight="quiet" icon={Play} label="Go on" act={() => run.goOn("on")} />
      ) : (
        <Button weight="quiet" icon={Pause} label="Pause" disabled={state === "idle"} act={run.pause} />
      )}
      {step(Redo2, "Step over: run this line", "over")}
      {step(ArrowDownToLine, "Step into the function of this line", "into")}
      {step(ArrowUpFromLine, "Step out of this function", "out")}
    </div>
  );
}

function Header() {
  const { state } = run.program.value;
  return (
    <header class="bar row">
      <img src="icon.svg" alt="elib" width={22} height={22} />
      <ProgramMenu />
      <span class="fill" />
      <Button icon={FlaskConical} aria-pressed={hasLabs.value} act={() => (hasLabs.value = !hasLabs.value)}>
        Labs
      </Button>
      <Button weight="quiet" icon={isDark() ? Sun : Moon} label="switch between light and dark" act={toggleTheme} />
      <Button
        id="run"
        weight="primary"
        icon={Play}
        title="Ctrl and Enter, or ⌘ and Enter"
        aria-keyshortcuts="Control+Enter Meta+Enter"
        disabled={state === "running" || run.isWaiting.value}
        act={run.run}
      >
        {state === "paused" ? "Go on" : run.isWaiting.value ? "Waits …" : "Run"}
      </Button>
      <button type="button" id="stop" class="stop" aria-keyshortcuts="Escape" onClick={stopAll}>
        <Icon of={Square} size={16} /> STOP <kbd>esc</kbd>
      </button>
    </header>
  );
}

export function Studio() {
  const world = useWorld("program");
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      event.stopPropagation();
      run.run();
    };
    addEventListener("keydown", press, true);
  }, []);
  return (
    <>
      <Header />
      {loading.value && <progress class="loading" max={1} value={loading.value.share} aria-label="loading Python" />}
      <main class="studio">
        <section class="write stack" aria-label="program">
          <p class={`hint row ${programs.unsaved.value ? "alarm" : ""}`} role="status">
            {programs.note.value}
          </p>
          <Code />
          <Output />
        </section>
        <section class="watch stack" aria-label="world">
          <div class="row wrap">
            <State />
            <Steps />
            <Select
              aria-label="speed"
              value={run.speed.value}
              choices={SPEEDS}
              choose={(value) => (run.speed.value = Number(value))}
            />
            <RobotMenu />
          </div>
          <div class="card stage">
            {world.scene.value ? (
              <World world={world} of="program" own={0} />
            ) : (
              <p class="hint">The world comes when Python is loaded.</p>
            )}
          </div>
          {hasLabs.value && <Labs />}
        </section>
      </main>
      <div class="toasts stack" role="status" aria-live="polite">
        {toasts.value.map(({ id, text }) => (
          <p class="toast alarm row" role="alert" key={id}>
            <span class="fill">{text}</span>
            <Button weight="quiet" icon={X} label="close" act={() => closeToast(id)} />
          </p>
        ))}
      </div>
      <Dialog stop={stopAll} />
    </>
  );
}
