// Markdown of others, such as instructions of labs: the part of it that they use, made into elements and text, never into HTML.
import type { ComponentChild } from "preact";

const BLOCK = /```[^]*?\n```|(?:.+(?:\n(?!```)|$))+/g;
const SPAN = /`([^`]+)`|\*\*(.+?)\*\*|!?\[([^\]]*)\]\(([^)\s]*)\)/g;

/** What stands in a line: code, bold words and links; pictures are left out. */
function spans(text: string) {
  const found: ComponentChild[] = [];
  let at = 0;
  for (const { 0: whole, 1: code, 2: bold, 3: words, 4: to, index } of text.matchAll(SPAN)) {
    found.push(text.slice(at, index));
    if (code) found.push(<code>{code}</code>);
    else if (bold) found.push(<b>{spans(bold)}</b>);
    else if (/^https?:/.test(to)) found.push(<a {...{ href: to, target: "_blank", rel: "noreferrer" }}>{words}</a>);
    else if (!whole.startsWith("!")) found.push(words);
    at = index + whole.length;
  }
  return [...found, text.slice(at)];
}

/** The items of a list, each with its further lines. */
const items = (text: string) =>
  text.split(/\n(?=[-*] |\d+\. )/).map((item) => <li>{spans(item.replace(/^\S+ /, ""))}</li>);

function row(line: string, k: number) {
  const Cell = k ? "td" : "th",
    cells = line.replace(/^\||\|$/g, "").split("|");
  return (
    k !== 1 && (
      <tr>
        {cells.map((cell) => (
          <Cell>{spans(cell.trim())}</Cell>
        ))}
      </tr>
    )
  ); // the second draws a line
}

function block(text: string) {
  if (text.startsWith("# ")) return null; // the title stands above already
  if (text.startsWith("#")) return <h3>{spans(text.replace(/^#+ /, ""))}</h3>;
  if (text.startsWith("```")) return <pre class="well">{text.replace(/^```.*\n|\n```$/g, "")}</pre>;
  if (text.startsWith("|")) return <table>{text.split("\n").map(row)}</table>;
  if (/^[-*] /.test(text)) return <ul>{items(text)}</ul>;
  return /^\d+\. /.test(text) ? <ol>{items(text)}</ol> : <p>{spans(text)}</p>;
}

export const Markdown = ({ text }: { text: string }) => <>{text.match(BLOCK)?.map((each) => block(each.trim()))}</>;
