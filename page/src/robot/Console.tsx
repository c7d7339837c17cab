// A line to the robot, with completion and the help of the command; what it answered stands above.
import { signal } from "@preact/signals";
import { CornerDownLeft } from "lucide";
import { useRef } from "preact/hooks";
import { Icon } from "../look/Icon";
import type { Completions } from "../messages";
import type { Robot } from "../store";
import { noteTyped } from "./hands";
import { kept } from "./kept";
import { Lines } from "./Lines";

const KEPT = 200;
const USE = "Choose or type a command. Tab completes it; ↑ and ↓ bring back what you sent.";
const START: Completions = { choices: ["help", "selector", "set_led 0 on", "play_sound 1"], help: USE };

type Said = [kind: "sent" | "came" | "bad", text: string];
const stateOf = kept(() => ({
  line: signal(""),
  said: signal<Said[]>([]),
  offer: signal(START),
  past: [] as string[],
  at: 0, // in the past
}));

/** The longest text that all begin with. */
const shared = (texts: string[]) =>
  texts.reduce((so, each) => {
    while (!each.startsWith(so)) so = so.slice(0, -1);
    return so;
  });

export function Console({ robot }: { robot: Robot }) {
  const state = stateOf(robot),
    { line, said, offer, past } = state,
    { choices, help } = offer.value,
    input = useRef<HTMLInputElement>(null);

  /** Ask what the line may become, and what it means. */
  async function fill(text: string) {
    line.value = text;
    input.current?.focus();
    const found = text ? await robot.ask("complete", { line: text }) : START;
    if (found && text === line.value) offer.value = found;
  }

  function press(event: KeyboardEvent) {
    if (event.key === "Tab" && !event.shiftKey && choices.length && line.value) {
      const next = shared(choices) + (choices.length === 1 ? " " : "");
      if (next.length <= line.value.length) return; // nothing to complete: Tab goes on to the next control
      event.preventDefault();
      fill(next);
    } else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      state.at = Math.max(0, Math.min(past.length, state.at + (event.key === "ArrowUp" ? -1 : 1)));
      fill(past[state.at] ?? "");
    }
  }

  async function send(event: Event) {
    event.preventDefault();
    const text = line.value.trim();
    if (!text) return;
    const say = (...each: Said) => (said.value = [...said.value, each].slice(-KEPT));
    state.at = past.push(text);
    say("sent", text);
    noteTyped();
    const work = robot.ask("console", { line: text });
    fill("");
    const answer = await work;
    if (answer) say(answer.is_bad ? "bad" : "came", answer.text);
  }

  return (
    <div class="stack fill console">
      <Lines label="answers" news={said.value}>
        {said.value.length === 0 && <p class="hint">What you send and what the robot answers stands here.</p>}
        {said.value.map(([kind, text]) => (
          <p class={kind}>{text}</p>
        ))}
      </Lines>
      <form class="row" onSubmit={send}>
        <input
          {...({ type: "text", autocomplete: "off", autocapitalize: "none", spellcheck: false } as const)}
          {...({ role: "combobox", "aria-label": "command", "aria-describedby": "console-help" } as const)}
          aria-controls="console-choices"
          aria-expanded={line.value !== "" && choices.length > 0}
          class="fill"
          ref={input}
          maxLength={200}
          placeholder="set_led 0 on"
          value={line.value}
          onInput={({ currentTarget }) => fill(currentTarget.value)}
          onKeyDown={press}
        />
        <button class="primary">
          <Icon of={CornerDownLeft} /> Send
        </button>
      </form>
      <ul role="listbox" class="row wrap" id="console-choices" aria-label="completions">
        {choices.slice(0, 12).map((each) => (
          <li role="option" class="chip" onClick={() => fill(`${each} `)}>
            {each}
          </li>
        ))}
      </ul>
      <p class="hint" id="console-help" role="status">
        {help}
      </p>
    </div>
  );
}
