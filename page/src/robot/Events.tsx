// What has happened, newest first, filtered by kind and text. Lines that repeat themselves soon are one that counts.
import { signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { Eraser } from "lucide";
import { Button } from "../look/Button";
import type { Line } from "../messages";
import { hello, type Robot } from "../store";
import { kept } from "./kept";
import "./lists.css";

const SOON = 10; // s
const LONG = /-?\d+\.\d{4,}/g; // a number with more digits than a person reads
const ARGUMENTS = /\(.*\)(?=: )/; // of a command

const stateOf = kept(() => ({
  text: signal(""),
  hidden: signal<string[]>([]),
  cleared: signal(0), // the number of the last line that was cleared
}));

/** Lines that say the same, but for the numbers of a command. */
type Group = { about: string; lines: Line[] };

/** Group lines, oldest first; a group stands where its newest line does. */
function grouped(lines: Line[]) {
  const groups = new Map<string, Group>(),
    old: Group[] = [];
  for (const line of lines) {
    const about = line.kind === "call" ? line.text.replace(ARGUMENTS, "") : line.text,
      key = `${line.kind} ${line.bad} ${about}`,
      group = groups.get(key);
    groups.delete(key);
    const isSoon = group && line.time - group.lines[group.lines.length - 1].time < SOON;
    if (group && !isSoon) old.push(group);
    if (isSoon) group.lines.push(line);
    groups.set(key, isSoon ? group : { about, lines: [line] });
  }
  const newest = ({ lines }: Group) => lines[lines.length - 1].number;
  return [...old, ...groups.values()].sort((one, other) => newest(other) - newest(one));
}

const short = (text: string) => text.replace(LONG, (digits) => String(+Number(digits).toFixed(3)));

export function Events({ robot }: { robot: Robot }) {
  const { text, hidden, cleared } = stateOf(robot),
    kinds = hello.value?.kinds ?? {},
    lines = robot.lines.value,
    // Only a kind that a person can show again may be hidden.
    offered = Object.keys(kinds).filter((kind) => lines.some((line) => line.kind === kind)),
    began = useMemo(() => Date.now() - 1000 * (robot.tick.peek()?.time ?? 0), [lines]);
  const groups = useMemo(() => {
    const wanted = text.value.toLowerCase();
    return grouped(
      lines.filter(
        (line) =>
          line.number > cleared.value && !hidden.value.includes(line.kind) && line.text.toLowerCase().includes(wanted),
      ),
    );
  }, [lines, text.value, hidden.value, cleared.value]);
  const toggle = (kind: string) =>
    (hidden.value = hidden.value.includes(kind)
      ? hidden.value.filter((each) => each !== kind)
      : [...hidden.value, kind]);
  const clock = ({ time }: Line) => <time>{new Date(began + 1000 * time).toTimeString().slice(0, 8)}</time>;
  const last = lines.at(-1)?.number ?? 0;
  return (
    <div class="stack grows events">
      <div class="row">
        <input
          type="search"
          class="fill"
          placeholder="Filter"
          maxLength={100}
          aria-label="text that lines must hold"
          value={text.value}
          onInput={(event) => (text.value = event.currentTarget.value)}
        />
        <Button weight="quiet" icon={Eraser} act={() => (cleared.value = last)}>
          Clear
        </Button>
      </div>
      <div class="row wrap kinds">
        {offered.map((kind) => (
          <label key={kind} class="check small">
            <input type="checkbox" checked={!hidden.value.includes(kind)} onChange={() => toggle(kind)} />
            {kinds[kind]}
          </label>
        ))}
      </div>
      <div class="lines" tabIndex={0} role="log" aria-label="events" data-keys="">
        {groups.length === 0 && <p class="hint">{last > cleared.value ? "No line matches." : "Nothing yet."}</p>}
        {groups.map(({ about, lines: [first, ...more] }) => {
          const head = (
            <>
              {clock(more.at(-1) ?? first)}
              <span class="fill">
                {short(more.length ? about : first.text)}
                {more.length > 0 && <b class="count"> × {more.length + 1}</b>}
              </span>
              <span class="kind">{kinds[first.kind] ?? first.kind}</span>
            </>
          );
          const kind = `event ${first.bad ? "bad" : ""}`;
          if (!more.length)
            return (
              <p key={first.number} class={kind}>
                {head}
              </p>
            );
          return (
            <details key={first.number} class={kind}>
              <summary>{head}</summary>
              {[first, ...more].reverse().map((line) => (
                <p key={line.number}>
                  {clock(line)} {short(line.text)}
                </p>
              ))}
            </details>
          );
        })}
      </div>
    </div>
  );
}
