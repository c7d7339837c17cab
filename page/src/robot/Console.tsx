// A line to the robot, with completion and the help of the command; what it answered stands above.
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { CornerDownLeft } from "lucide";
import { Icon } from "../look/Icon";
import type { Completions } from "../messages";
import type { Robot } from "../store";
import { kept } from "./kept";
import "./lists.css";

const KEPT = 200;
const USE = "Choose or type a command. Tab completes it; ↑ and ↓ bring back what you sent.";
const START: Completions = { choices: ["help", "selector", "set_led 0 on", "play_sound 1"], help: USE };

const stateOf = kept(() => ({
  line: signal(""),
  said: signal<[kind: "sent" | "came" | "bad", text: string][]>([]),
  offer: signal(START),
  past: [] as string[],
  at: 0, // in the past
}));

export function Console({ robot }: { robot: Robot }) {
  const state = stateOf(robot),
    { line, said, offer } = state;
  const output = useRef<HTMLDivElement>(null),
    input = useRef<HTMLInputElement>(null);
  useEffect(() => output.current!.scrollTo(0, output.current!.scrollHeight), [said.value]);

  /** Ask what the line may become, and what it means. */
  async function fill(text: string) {
    line.value = text;
    input.current?.focus();
    if (!text) return void (offer.value = START);
    const found = await robot.ask("complete", { line: text });
    if (found && text === line.value) offer.value = found;
  }

  function press(event: KeyboardEvent) {
    const { choices } = offer.value;
    if (event.key === "Tab" && !event.shiftKey && choices.length && line.value) {
      const shared = choices.reduce((so, each) => {
        while (!each.startsWith(so)) so = so.slice(0, -1);
        return so;
      });
      const next = choices.length === 1 ? `${shared} ` : shared;
      if (next.length <= line.value.length) return; // nothing to complete: Tab goes on to the next control
      event.preventDefault();
      fill(next);
    } else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      state.at = Math.max(0, Math.min(state.past.length, state.at + (event.key === "ArrowUp" ? -1 : 1)));
      fill(state.past[state.at] ?? "");
    }
  }

  async function send(event: Event) {
    event.preventDefault();
    const text = line.value.trim();
    if (!text) return;
    const say = (...entry: (typeof said.value)[number]) => (said.value = [...said.value, entry].slice(-KEPT));
    state.past.push(text);
    state.at = state.past.length;
    say("sent", text);
    const work = robot.ask("console", { line: text });
    fill("");
    const answer = await work;
    if (answer) say(answer.is_bad ? "bad" : "came", answer.text);
  }

  return (
    <div class="stack grows console">
      <div class="lines" ref={output} tabIndex={0} role="log" aria-label="answers" data-keys="">
        {said.value.length === 0 && <p class="hint">What you send and what the robot answers stands here.</p>}
        {said.value.map(([kind, text]) => (
          <p class={kind}>{text}</p>
        ))}
      </div>
      <form class="row" onSubmit={send}>
        <input
          ref={input}
          class="fill"
          type="text"
          maxLength={200}
          autocomplete="off"
          autocapitalize="none"
          spellcheck={false}
          placeholder="set_led 0 on"
          aria-label="command"
          aria-describedby="console-help"
          role="combobox"
          aria-expanded={line.value !== "" && offer.value.choices.length > 0}
          aria-controls="console-choices"
          value={line.value}
          onInput={(event) => fill(event.currentTarget.value)}
          onKeyDown={press}
        />
        <button class="primary">
          <Icon of={CornerDownLeft} />
          Send
        </button>
      </form>
      <ul role="listbox" id="console-choices" aria-label="completions">
        {offer.value.choices.slice(0, 12).map((each) => (
          <li key={each} role="option" onClick={() => fill(`${each} `)}>
            {each}
          </li>
        ))}
      </ul>
      <p class="hint" id="console-help" role="status">
        {offer.value.help}
      </p>
    </div>
  );
}
