// The files of one robot: a log, a recording of everything, and recordings of the folder that can be played.
import { useSignal } from "@preact/signals";
import { Play, RotateCw } from "lucide";
import { useEffect } from "preact/hooks";
import { Button } from "../look/Button";
import { bytes } from "../look/text";
import type { FileList } from "../messages";
import { address, go } from "../route";
import { ask, hello, type Robot } from "../store";
import "./lists.css";

const ABOUT = {
  recording: "All that happens on the robot's link. It can be played here later, repeated and compared.",
  log: "A text file: what the robot was told to do, how it ended, and when.",
};

type Props = {
  robot: Robot;
  kind: "log" | "recording";
  free?: string;
  isLooking: boolean;
  look: () => Promise<void>;
};

function Writing({ robot, kind, free = "", isLooking, look }: Props) {
  const { log = null, recorder = null, phase = "failed" } = robot.tick.value ?? {},
    isOn = (kind === "log" ? log : recorder) !== null,
    typed = useSignal<string | null>(null), // null: the free name that the program proposes
    name = typed.value ?? free;
  const turn = async () => {
    if (!isOn) await robot.ask(`start_${kind}`, { name });
    else if ((await robot.ask(`stop_${kind}`, {})) !== undefined) typed.value = null;
    await look();
  };
  const size = kind === "recording" && recorder ? `: ${bytes(recorder)}` : "",
    begins = "It begins when the robot is connected.",
    state = ["connected", "gap"].includes(phase) ? `The file is being written${size}.` : begins;
  return (
    <section class="stack" aria-label={kind}>
      <h3>{kind === "log" ? "Log" : "Recording"}</h3>
      <p class="hint">{ABOUT[kind]}</p>
      <div class="row">
        <input
          {...({ type: "text", class: "fill", maxLength: 80, spellcheck: false } as const)}
          aria-label={`file of the ${kind}`}
          disabled={isOn || (isLooking && typed.value === null)} // else what is typed now joins the name that comes
          value={name}
          onInput={({ currentTarget }) => (typed.value = currentTarget.value)}
        />
        <Button disabled={!isOn && !name} act={turn}>
          {isOn ? "Stop" : kind === "log" ? "Start log" : "Record"}
        </Button>
      </div>
      <p role="status">{isOn && state}</p>
    </section>
  );
}

export function Files({ robot }: { robot: Robot }) {
  const found = useSignal<FileList | null>(null),
    isLooking = useSignal(true),
    { log, recording, recordings } = found.value ?? {},
    folder = hello.value?.folder;
  /** Look into the folder: which recordings it has, and which names are free. */
  const look = async () => {
    isLooking.value = true;
    found.value = (await ask("files", {})) ?? found.value;
    isLooking.value = false;
  };
  useEffect(() => void look(), []);
  const play = async (name: string) => {
    const keys = await ask("open_recording", { name });
    if (keys) go(address(keys[0]));
  };
  const day = (time: number) => new Date(1000 * time).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
  return (
    <div class="stack files">
      <Writing {...{ robot, look }} isLooking={isLooking.value} kind="recording" free={recording} />
      <Writing {...{ robot, look }} isLooking={isLooking.value} kind="log" free={log} />
      <section class="stack" aria-label="recordings">
        <div class="row">
          <h3 class="fill">Play a recording</h3>
          <Button weight="quiet" icon={RotateCw} label="Look again" act={look} />
        </div>
        {recordings?.length === 0 && <p class="hint">There is no recording in the folder yet.</p>}
        {recordings?.map(([name, time, size]) => (
          <div key={name} class="recording">
            <Button weight="quiet" icon={Play} act={() => play(name)}>
              {name}
            </Button>
            <p class="small">{`${day(time)}, ${bytes(size)}`}</p>
          </div>
        ))}
      </section>
      <p class="hint">{`Files are written to the folder that the program was started in${folder && `: ${folder}`}.`}</p>
    </div>
  );
}
