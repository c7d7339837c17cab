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

type Props = { robot: Robot; kind: "log" | "recording"; free: string; look: () => Promise<void> };

/** What is written: its name, and since when. */
function Writing({ robot, kind, free, look }: Props) {
  const { log = null, recorder = null, phase } = robot.tick.value ?? {},
    typed = useSignal<string | null>(null); // null: the free name that the program proposes
  const isLog = kind === "log",
    isOn = (isLog ? log : recorder) !== null,
    name = typed.value ?? free,
    size = !isLog && recorder ? `: ${bytes(recorder.bytes)}` : "";
  const turn = async () => {
    if (isOn) await robot.ask(isLog ? "stop_log" : "stop_recording", {});
    else await robot.ask(isLog ? "start_log" : "start_recording", { name });
    if (isOn) typed.value = null;
    await look();
  };
  return (
    <section class="stack" aria-label={isLog ? "Log" : "Recording"}>
      <h3>{isLog ? "Log" : "Recording"}</h3>
      <p class="hint">
        {isLog
          ? "One line for each call: what was asked, how it ended, and when."
          : "Everything: each byte, each reading, each event. It can be played here, repeated and compared."}
      </p>
      <div class="row">
        <input
          type="text"
          class="fill"
          maxLength={80}
          spellcheck={false}
          aria-label={`file of the ${kind}`}
          disabled={isOn}
          value={name}
          onInput={(event) => (typed.value = event.currentTarget.value)}
        />
        <Button act={turn}>{isOn ? "Stop" : "Start"}</Button>
      </div>
      <p class="small" role="status">
        {isOn &&
          (phase === "connected" || phase === "gap"
            ? `The file is being written${size}.`
            : "It begins when the robot is connected.")}
      </p>
    </section>
  );
}

export function Files({ robot }: { robot: Robot }) {
  const found = useSignal<FileList | null>(null),
    folder = hello.value?.folder;
  /** Look into the folder: which recordings it has, and which names are free. */
  const look = async () => {
    found.value = (await ask("files", {})) ?? found.value;
  };
  useEffect(() => void look(), []);
  const play = async (name: string) => {
    const keys = await ask("open_recording", { name });
    if (keys) go(address(keys[0]));
  };
  const { log = "", recording = "", recordings } = found.value ?? {};
  return (
    <div class="stack files">
      <Writing robot={robot} kind="log" free={log} look={look} />
      <Writing robot={robot} kind="recording" free={recording} look={look} />
      <section class="stack" aria-label="recordings">
        <div class="row">
          <h3 class="fill">Play a recording</h3>
          <Button weight="quiet" icon={RotateCw} label="Look again" act={look} />
        </div>
        {recordings?.length === 0 && <p class="hint">There is no recording in the folder yet.</p>}
        <ul>
          {recordings?.map(([name, time, size]) => (
            <li key={name}>
              <Button weight="quiet" icon={Play} act={() => play(name)}>
                {name}
              </Button>
              <p class="small">
                {new Date(1000 * time).toLocaleString([], { dateStyle: "medium", timeStyle: "short" })}, {bytes(size)}
              </p>
            </li>
          ))}
        </ul>
      </section>
      <p class="hint">{`Files are written to the folder that the program was started in${folder && `: ${folder}`}.`}</p>
    </div>
  );
}
