// What the program prints, with links to its lines; and where it is paused, its variables and the calls that it is in.
import { Eraser } from "lucide";
import { useMemo } from "preact/hooks";
import { Button } from "../look/Button";
import { Lines } from "../robot/Lines";
import { blocks, clear, dropped, program, shownLine, type Line } from "./run";

const LINE = /(File "[^"]*", )?\bline (\d+)\b/g;

/** A line; in what went wrong, lines of the program are links, and those of other files are not. */
function Text({ text, isError }: Line) {
  if (!isError) return <p>{text}</p>;
  const parts: preact.ComponentChild[] = [];
  let at = 0;
  for (const { 0: found, 1: file, 2: line, index } of text.matchAll(LINE)) {
    if (file && !file.includes(`"${program.value.name}"`)) continue;
    parts.push(text.slice(at, index), <LineLink line={Number(line)}>{found}</LineLink>);
    at = index + found.length;
  }
  return (
    <p class="bad">
      {parts}
      {text.slice(at)}
    </p>
  );
}

export const LineLink = ({ line, children }: { line: number; children: preact.ComponentChildren }) => (
  <button type="button" class="line" onClick={() => (shownLine.value = { line })}>
    {children}
  </button>
);

/** Lines that stay as they are are drawn once. */
const Block = ({ lines }: { lines: Line[] }) => useMemo(() => <>{lines.map((line) => Text(line))}</>, [lines]);

export function Output() {
  const first = dropped.value,
    { state } = program.value;
  return (
    <div class="below">
      <section class="stack" aria-label="output">
        <div class="row">
          <h3 class="fill">Output</h3>
          <Button weight="quiet" icon={Eraser} label="Clear the output" act={clear} />
        </div>
        <Lines label="output" news={blocks.value}>
          {first > 0 && <p class="hint">{first} lines before these are gone.</p>}
          {!blocks.value.length && <p class="hint">What the program prints stands here.</p>}
          {blocks.value.map((lines, k) => (
            <Block key={first + k} lines={lines} />
          ))}
        </Lines>
      </section>
      {state === "paused" && <Paused />}
    </div>
  );
}

function Paused() {
  const { variables, stack } = program.value;
  return (
    <section class="stack" aria-label="variables">
      <h3>Variables</h3>
      <div class="lines well" tabIndex={0} data-keys="">
        {!variables.length && <p class="hint">There is none yet.</p>}
        <table>
          {variables.map(({ name, value, type }) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{value}</td>
              <td class="hint">{type}</td>
            </tr>
          ))}
        </table>
        {stack.length > 1 && <h3>Called from</h3>}
        {stack.map(({ function: called, line }) => (
          <p>
            <LineLink line={line}>line {line}</LineLink> {called}
          </p>
        ))}
      </div>
    </section>
  );
}
