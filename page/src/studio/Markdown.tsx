// Instructions of labs: the part of Markdown that they use, made into elements and text, never into HTML.
import type { ComponentChild } from "preact";

const SPAN = /`([^`]+)`|\*\*(.+?)\*\*|\*([^*\s][^*]*)\*|!?\[([^\]]*)\]\(([^)\s]*)\)/g;

/** What stands in a line: code, words that are bold or slanted, and links; pictures are left out. */
function spans(text: string) {
  const found: ComponentChild[] = [];
  let at = 0;
  for (const { 0: whole, 1: code, 2: bold, 3: slanted, 4: words, 5: to, index } of text.matchAll(SPAN)) {
    found.push(text.slice(at, index));
    if (code) found.push(<code>{code}</code>);
    else if (bold) found.push(<b>{spans(bold)}</b>);
    else if (slanted) found.push(<i>{slanted}</i>);
    else if (/^https?:/.test(to)) found.push(<a {...{ href: to, target: "_blank", rel: "noreferrer" }}>{words}</a>);
    else if (!whole.startsWith("!")) found.push(words);
    at = index + whole.length;
  }
  return [...found, text.slice(at)];
}

const cells = (line: string) => line.replace(/^\||\|$/g, "").split("|");

/** The items of a list, each with its further lines. */
const items = (text: string) =>
  text.split(/\n(?=[-*] |\d+\. )/).map((item) => <li>{spans(item.replace(/^\S+ /, ""))}</li>);

function block(text: string) {
  const [, marks, heading] = /^(#+) (.*)/.exec(text) ?? [];
  if (marks) return marks.length === 1 ? null : <h3>{spans(heading)}</h3>;
  if (text.startsWith("```")) return <pre class="well">{text.replace(/^```.*\n|\n```$/g, "")}</pre>;
  if (/^[-*] /.test(text)) return <ul>{items(text)}</ul>;
  if (/^\d+\. /.test(text)) return <ol>{items(text)}</ol>;
  if (!text.startsWith("|")) return <p>{spans(text)}</p>;
  const [head, , ...rows] = text.split("\n");
  return (
    <table>
      <tr>
        {cells(head).map((cell) => (
          <th>{spans(cell)}</th>
        ))}
      </tr>
      {rows.map((row) => (
        <tr>
          {cells(row).map((cell) => (
            <td>{spans(cell)}</td>
          ))}
        </tr>
      ))}
    </table>
  );
}

/** The title is left out: it stands above already. */
export const Markdown = ({ text }: { text: string }) => (
  <>{text.match(/```[^]*?\n```|(?:.+(?:\n(?!\n|```)|$))+/gm)?.map((each) => block(each.trim()))}</>
);
