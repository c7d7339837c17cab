// What has happened, newest first, filtered by kind and text. Lines that repeat themselves soon are one that counts.
import { signal } from "@preact/signals";
import { Eraser } from "lucide";
import { useMemo } from "preact/hooks";
import { Button } from "../look/Button";
import { Check } from "../look/fields";
import type { Line } from "../messages";
import { hello, type Robot } from "../store";
import { kept, toggled } from "./kept";
import { Lines } from "./Lines";

const SOON = 10; // s
const LONG = /-?\d+\.\d{4,}/g; // a number with more digits than a person reads
const ARGUMENTS = /\(.*\)(?=: )/; // of a command

const stateOf = kept(() => ({
  wanted: signal(""),
  hidden: signal<string[]>([]), // kinds
  cleared: signal(-1), // the number of the last line that was cleared
}));

/** Lines that say the same but for the arguments of a command, the newest first. */
type Group = { about: string; lines: Line[] };

function grouped(lines: Line[]) {
  const groups: Group[] = [],
    newest = new Map<string, Group>();
  for (const line of lines) {
    const about = line.kind === "call" ? line.text.replace(ARGUMENTS, "") : line.text,
      key = `${line.kind} ${line.bad} ${about}`,
      group = newest.get(key);
    if (group && line.time - group.lines[0].time < SOON) group.lines.unshift(line);
    else newest.set(key, groups[groups.push({ about, lines: [line] }) - 1]);
  }
  return groups.sort((one, other) => other.lines[0].number - one.lines[0].number);
}

const short = (text: string) => text.replace(LONG, (digits) => String(+Number(digits).toFixed(3)));

export function Events({ robot }: { robot: Robot }) {
  const { wanted, hidden, cleared } = stateOf(robot),
    titles = hello.value?.kinds ?? {},
    lines = robot.lines.value,
    last = lines.at(-1)?.number ?? -1;
  const began = useMemo(() => Date.now() - 1000 * (robot.tick.peek()?.time ?? 0), [lines]),
    clock = ({ time }: Line) => <time>{new Date(began + 1000 * time).toTimeString().slice(0, 8)}</time>;
  const isShown = ({ number, kind, text }: Line) =>
    number > cleared.value && !hidden.value.includes(kind) && text.toLowerCase().includes(wanted.value.toLowerCase());
  const groups = grouped(lines.filter(isShown));
  return (
    <div class="stack fill events">
      <div class="row">
        <input
          type="search"
          class="fill"
          placeholder="Filter"
          maxLength={100}
          aria-label="text that lines must hold"
          value={wanted.value}
          onInput={({ currentTarget }) => (wanted.value = currentTarget.value)}
        />
        <Button weight="quiet" icon={Eraser} act={() => (cleared.value = last)}>
          Clear
        </Button>
      </div>
      <div class="row wrap kinds">
        {Object.entries(titles).map(
          ([kind, title]) =>
            lines.some((line) => line.kind === kind) && (
              <Check
                class="small"
                isOn={!hidden.value.includes(kind)}
                act={() => (hidden.value = toggled(hidden.value, kind))}
              >
                {title}
              </Check>
            ),
        )}
      </div>
      <Lines label="events">
        {groups.length === 0 && <p class="hint">{last > cleared.value ? "No line matches." : "Nothing yet."}</p>}
        {groups.map(({ about, lines: [newest, ...old] }) => (
          <details key={(old.at(-1) ?? newest).number} class={newest.bad ? "bad" : ""}>
            <summary tabIndex={old.length ? 0 : -1}>
              {clock(newest)}
              <span class="fill">
                {short(old.length ? about : newest.text)}
                {old.length > 0 && <b>{` × ${old.length + 1}`}</b>}
              </span>
              <span class="hint">{titles[newest.kind] ?? newest.kind}</span>
            </summary>
            {old.length > 0 &&
              [newest, ...old].map((line) => (
                <p>
                  {clock(line)} {short(line.text)}
                </p>
              ))}
          </details>
        ))}
      </Lines>
    </div>
  );
}
