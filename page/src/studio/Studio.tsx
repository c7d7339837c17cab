// The studio: on the left the program, with what it prints below it; on the right its world, and the lab that it is for.
import * as icons from "lucide";
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Dialog } from "../look/Dialog";
import { Select } from "../look/fields";
import { Icon } from "../look/Icon";
import { isDark, toggleTheme } from "../look/theme";
import { Toasts } from "../look/Toasts";
import { stop } from "../stop";
import { Camera } from "../robot/Camera";
import { Charts } from "../robot/Charts";
import { Events } from "../robot/Events";
import { Sensors } from "../robot/Sensors";
import "../robot/robot.css";
import { isSilent, listed, robotOf, subscribe } from "../store";
import { useWorld } from "../world/live";
import { World } from "../world/World";
import { editIn } from "./editor";
import { Help } from "./Help";
import { hasLabs, Labs } from "./Labs";
import { Output } from "./Output";
import { ProgramMenu } from "./ProgramMenu";
import { note, unsaved } from "./programs";
import { RobotMenu } from "./RobotMenu";
import { States } from "./States";
import { isOpen as hasStates } from "./machine";
import * as run from "./run";
import { loading } from "./wire";
import "./studio.css";

const SPEEDS = [0.25, 0.5, 1, 2, 5, 0].map((speed) => [speed, `× ${speed || "max"}`] as const);

function Code() {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => editIn(box.current!), []);
  return <div class="code well" ref={box} data-keys="" data-writes="" />;
}

/** What Python does, and where the program is. */
function State() {
  const { state, line, name, mistake } = run.program.value,
    atRest = !name ? ["", "ready"] : mistake ? ["failed", "ended by an error"] : ["", "ended"],
    isLost = state === "running" && isSilent.value;
  const [colour, words] = loading.value
    ? ["connecting", loading.value]
    : isLost
      ? ["connecting", "runs without a pause"]
      : { idle: atRest, running: ["connected", "runs"], paused: ["gap", `paused at line ${line}`] }[state];
  return (
    <p class="chip" role="status" data-phase={colour}>
      {words}
    </p>
  );
}

function Steps() {
  const { state } = run.program.value,
    isPaused = state === "paused",
    tool = (icon: icons.IconNode, label: string, act: () => unknown, isOn = isPaused) => (
      <Button weight="quiet" {...{ icon, label, act }} disabled={!isOn} />
    );
  return (
    <div class="row steps" role="group" aria-label="pause and steps">
      {tool(icons.Pause, "Pause", run.pause, state === "running")}
      {tool(icons.Redo2, "Step over: run this line", () => run.goOn("over"))}
      {tool(icons.ArrowDownToLine, "Step into the function that this line calls", () => run.goOn("into"))}
      {tool(icons.ArrowUpFromLine, "Step out of this function", () => run.goOn("out"))}
    </div>
  );
}

function Header() {
  const { state } = run.program.value,
    isWaiting = run.isWaiting.value;
  return (
    <header class="bar row">
      <img src="icon.svg" alt="elib" width={22} height={22} />
      <ProgramMenu />
      <span class="fill" />
      <Button icon={icons.FlaskConical} aria-pressed={hasLabs.value} act={() => (hasLabs.value = !hasLabs.value)}>
        Labs
      </Button>
      <Button icon={icons.Workflow} aria-pressed={hasStates.value} act={() => (hasStates.value = !hasStates.value)}>
        States
      </Button>
      <Help />
      <Button weight="quiet" icon={isDark() ? icons.Sun : icons.Moon} label="light or dark" act={toggleTheme} />
      <Button
        {...({ id: "run", weight: "primary", icon: icons.Play, act: run.run } as const)}
        {...{ title: "Ctrl and Enter, or ⌘ and Enter", "aria-keyshortcuts": "Control+Enter Meta+Enter" }}
        disabled={state === "running" || isWaiting}
      >
        {state === "paused" ? "Go on" : isWaiting ? "Waits …" : "Run"}
      </Button>
      <button type="button" id="stop" class="stop" aria-keyshortcuts="Escape" onClick={stop}>
        <Icon of={icons.Square} size={16} /> STOP <kbd>esc</kbd>
      </button>
    </header>
  );
}

/** What the robot of the program tells it: the parts of the panel's page. */
const PARTS = { Sensors, Charts, Camera, Events };
const part = signal<keyof typeof PARTS | "World">("World");

function Part() {
  const world = useWorld("program"),
    key = listed.value[0]?.key ?? "",
    Kind = part.value === "World" ? null : PARTS[part.value];
  useEffect(() => (key ? subscribe({ what: "robot", of: key, rate: 10 }) : undefined), [key]);
  if (!Kind && run.isReal.value) return <p class="hint">A real robot has no world to look at.</p>;
  if (!world.scene.value) return <p class="hint">The world comes when Python is loaded.</p>;
  if (!Kind) return <World world={world} of="program" own={0} isOfProgram />;
  return (
    <div class="stack part">
      {key ? <Kind key={key} robot={robotOf(key)} /> : <p class="hint">What the robot of the program tells it.</p>}
    </div>
  );
}

const Parts = () => (
  <div class="row parts scrolls" role="tablist" aria-label="parts of the robot">
    {(["World", ...Object.keys(PARTS)] as (typeof part.value)[]).map((each) => (
      <button
        key={each}
        type="button"
        class="button tab"
        role="tab"
        aria-selected={part.value === each}
        onClick={() => (part.value = each)}
      >
        {each}
      </button>
    ))}
  </div>
);

export function Studio() {
  return (
    <>
      <Header />
      <main class="studio">
        <section class="stack" aria-label="program">
          <p class={`hint note ${unsaved.value && "bad"}`} role="status">
            {note.value}
          </p>
          <States />
          <Code />
          <Output />
        </section>
        <section class="stack" aria-label="world">
          <div class="row wrap">
            <State />
            <Steps />
            <Select
              aria-label="speed"
              value={run.speed.value}
              choices={SPEEDS}
              choose={(speed) => (run.speed.value = Number(speed))}
            />
            <RobotMenu />
          </div>
          <Parts />
          <div class="card stage">
            <Part />
          </div>
          {hasLabs.value && <Labs />}
        </section>
      </main>
      <Toasts />
      <Dialog stop={run.isIdle() ? undefined : stop} />
    </>
  );
}
