// What the program prints, with links to its lines; and where it is paused, its variables and the calls that it is in.
import type { ComponentChild, VNode } from "preact";
import { Lines } from "../robot/Lines";
import { lines, MOST_LINES, program, shownLine, type Line } from "./run";

const SHOWN = 200; // lines while the program runs, for a flood has no time to draw more
const LINE = /(?:File "([^"]*)", )?\bline (\d+)\b/g;

const Link = ({ line, text }: { line: number; text: string }) => (
  <button type="button" class="line" onClick={() => (shownLine.value = { line })}>
    {text}
  </button>
);

/** A line; in what went wrong, lines of the program are links, and those of other files are not. */
function textOf({ number, text, isError }: Line) {
  const parts: ComponentChild[] = [];
  let at = 0;
  for (const { 0: found, 1: file, 2: line, index } of isError ? text.matchAll(LINE) : []) {
    if (file && file !== program.value.name) continue; // not the program
    parts.push(text.slice(at, index), <Link line={Number(line)} text={found} />);
    at = index + found.length;
  }
  return (
    <p key={number} class={isError ? "bad" : ""}>
      {[...parts, text.slice(at)]}
    </p>
  );
}

const made = new WeakMap<Line, VNode>(); // an element that is the same is not looked at again

function drawn(line: Line) {
  const element = made.get(line) ?? textOf(line);
  made.set(line, element);
  return element;
}

export function Output() {
  const { state, variables, stack } = program.value,
    isRunning = state === "running",
    shown = isRunning ? lines.value.slice(-SHOWN) : lines.value,
    isMore = (shown[0]?.number ?? 0) > 0;
  return (
    <div class="below">
      <section class="stack" aria-label="output">
        <h3>Output</h3>
        <Lines label="output" news={lines.value}>
          {isMore && (
            <p class="hint">{`The last ${isRunning ? `${SHOWN} lines; all of them when it ends` : `${MOST_LINES} lines`}:`}</p>
          )}
          {!shown.length && <p class="hint">What the program prints stands here.</p>}
          {shown.map(drawn)}
        </Lines>
      </section>
      {state === "paused" && (
        <section class="stack" aria-label="variables">
          <h3>Variables</h3>
          <Lines label="variables">
            <table>
              {variables.map(({ name, value, type }) => (
                <tr key={name}>
                  <th scope="row">{name}</th>
                  <td title={type}>{value}</td>
                </tr>
              ))}
            </table>
            {stack.map(({ function: called, line }) => (
              <p>
                <Link line={line} text={`line ${line}`} /> in {called}
              </p>
            ))}
          </Lines>
        </section>
      )}
    </div>
  );
}
