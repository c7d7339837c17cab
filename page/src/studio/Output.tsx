// What the program prints, with links to its lines; and where it is paused, its variables and the calls that it is in.
import { Eraser } from "lucide";
import type { ComponentChild, ComponentChildren } from "preact";
import { useMemo } from "preact/hooks";
import { Button } from "../look/Button";
import { Lines } from "../robot/Lines";
import { blocks, clear, dropped, program, shownLine, type Line } from "./run";

const LINE = /(?:File "([^"]*)", )?\bline (\d+)\b/g;

const Link = ({ line, children }: { line: string | number; children: ComponentChildren }) => (
  <button type="button" class="line" onClick={() => (shownLine.value = { line: Number(line) })}>
    {children}
  </button>
);

/** A line; in what went wrong, lines of the program are links, and those of other files are not. */
function printed({ text, isError }: Line) {
  const parts: ComponentChild[] = [];
  let at = 0;
  for (const { 0: found, 1: file, 2: line, index } of isError ? text.matchAll(LINE) : []) {
    if (file && file !== program.peek().name) continue;
    parts.push(text.slice(at, index), <Link line={line}>{found}</Link>);
    at = index + found.length;
  }
  return <p class={isError ? "bad" : ""}>{[...parts, text.slice(at)]}</p>;
}

/** Lines that stay as they are are drawn once. */
const Block = ({ lines }: { lines: Line[] }) => useMemo(() => <>{lines.map(printed)}</>, [lines]);

export const Output = () => (
  <div class="below">
    <section class="stack" aria-label="output">
      <div class="row">
        <h3 class="fill">Output</h3>
        <Button weight="quiet" icon={Eraser} label="Clear the output" act={clear} />
      </div>
      <Lines label="output" news={blocks.value}>
        {dropped.value > 0 && <p class="hint">{dropped.value} lines before these are gone.</p>}
        {!blocks.value.length && <p class="hint">What the program prints stands here.</p>}
        {blocks.value.map((lines, k) => (
          <Block key={dropped.value + k} lines={lines} />
        ))}
      </Lines>
    </section>
    {program.value.state === "paused" && <Paused />}
  </div>
);

function Paused() {
  const { variables, stack } = program.value;
  return (
    <section class="stack" aria-label="variables">
      <h3>Variables</h3>
      <div class="lines well" tabIndex={0} data-keys="">
        {!variables.length && <p class="hint">There are none yet.</p>}
        <table>
          {variables.map(({ name, value, type }) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{value}</td>
              <td class="hint">{type}</td>
            </tr>
          ))}
        </table>
        {stack.map(({ function: called, line }) => (
          <p>
            <Link line={line}>line {line}</Link> in {called}
          </p>
        ))}
      </div>
    </section>
  );
}
