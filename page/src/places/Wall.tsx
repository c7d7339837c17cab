// The wall of a class: the world of each student, live and small, and who drives or is stuck.
import { computed, effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { OctagonX, Play } from "lucide";
import { Button } from "../look/Button";
import { stop, stops } from "../stop";
import { ask, can, subscribe, worldOf, worldsOfRobots } from "../store";
import { stageOf } from "../world/World";
import "./Wall.css";

const RATE = 5; // pictures of each world a second: twenty are looked at, and none is driven here
const STUCK = 3; // s that wheels turn and the robot stays where it is
const STEPS = 30; // of the wheels in a second, from which on they turn
const STILL = 0.004; // m, and 10 times that in rad: a robot that moves less in a second stays

const IS_LOCAL = /^(127\.|localhost$|\[::1\]$)/.test(location.hostname);

type State = "drives" | "stuck" | "cut" | "free";
const WORDS: Record<State, [words: string, kind: string]> = {
  drives: ["a program drives", "good"],
  stuck: ["stuck", "warn"],
  cut: ["link cut", "warn"],
  free: ["no program", ""],
};

/** How the students are, by their numbers, which are the channels of their worlds, too. */
const states = signal<Record<string, State>>({});
const channels = () => worldsOfRobots.value.map(([key]) => Number(key));
const isPaused = computed(() => channels().some((channel) => worldOf(channel).clock.value.paused));

/** Note once a second how the first robot of a student is. */
function watch(student: string) {
  const world = worldOf(Number(student));
  let before: number[] = [],
    stuck = 0;
  return effect(() => {
    const { encoders, link } = world.readings.value ?? {},
      [x, y, heading] = world.frame.peek()?.poses ?? [];
    if (!encoders || !link || x === undefined) return;
    const now = [...encoders, x, y, heading],
      [left, right, dx, dy, turned] = now.map((each, k) => Math.abs(each - (before[k] ?? each)));
    const turns = left + right > STEPS && Math.hypot(dx, dy) < STILL && turned < 10 * STILL;
    stuck = turns ? stuck + 1 : 0;
    before = now;
    const state = link.cut ? "cut" : stuck >= STUCK ? "stuck" : link.connected ? "drives" : "free";
    if (states.peek()[student] !== state) states.value = { ...states.peek(), [student]: state };
  });
}

function Tile({ student }: { student: string }) {
  const canvas = useRef<HTMLCanvasElement>(null),
    channel = Number(student),
    state = states.value[student] ?? "free",
    [words, kind] = WORDS[state];
  useEffect(() => subscribe({ what: "world", of: student, rate: RATE, channel }), [student]);
  useEffect(() => subscribe({ what: "readings", of: "0", rate: 1, channel }), [student]);
  useEffect(() => watch(student), [student]);
  useEffect(() => {
    const made = stageOf(canvas.current!, worldOf(channel));
    return () => void made.then((stage) => stage?.close());
  }, [student]);
  return (
    <a class="card student" href={`#/all/${student}`} data-state={state} aria-label={`student ${student}: ${words}`}>
      <div>
        <canvas class="over" ref={canvas} />
      </div>
      <span class="row">
        <b>{student}</b>
        <span class={`fill small ${kind}`}>{words}</span>
      </span>
    </a>
  );
}

export function Wall() {
  const students = worldsOfRobots.value.map(([key]) => key),
    count = (state: State) => students.filter((each) => states.value[each] === state).length,
    across = Math.round(Math.sqrt(1.4 * students.length)), // what fills a window that is wider than high
    told = [
      `${count("drives")} driving`,
      `${count("stuck")} stuck`,
      `${count("free") + count("cut")} without a program`,
    ];
  const all = (what: "pause" | "resume") => () => Promise.all(channels().map((channel) => ask(what, { channel })));
  useEffect(() => {
    const before = stops.peek();
    return stops.subscribe((count) => count > before && can().speed && all("pause")()); // by Space, too
  }, []);
  return (
    <div class="wall">
      <div class="row wrap">
        <h1>Class of {students.length}</h1>
        <p class="fill hint" role="status">
          {told.join(" · ")}. Students open {location.host}/student/1, and so on
          {IS_LOCAL ? ": on this computer only; elib simulate --class --host lets other computers in." : "."}
        </p>
        {can().speed &&
          (isPaused.value ? (
            <Button weight="primary" icon={Play} act={all("resume")}>
              Go on
            </Button>
          ) : (
            <Button
              weight="stop"
              icon={OctagonX}
              title="All worlds stand still. A program that waits too long for an answer ends with an error."
              act={stop}
            >
              STOP ALL <kbd>space</kbd>
            </Button>
          ))}
      </div>
      <div class="students columns" style={{ "--across": across }}>
        {students.map((student) => (
          <Tile key={student} student={student} />
        ))}
      </div>
    </div>
  );
}
