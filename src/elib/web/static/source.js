// The text of a behaviour, with its words in colour; and what a running one says.

import { make, say } from "./dom.js";

const WORD =
  /("""[\s\S]*?"""|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|(#.*)|\b(async|await|def|class|return|while|for|in|if|elif|else|from|import|as|with|try|except|finally|not|and|or|is|None|True|False|raise|pass|break|continue|yield|lambda|match|case)\b|\b(\d[\d_.]*)\b|(@\w+)/g;
const KINDS = ["text", "remark", "word", "number", "mark"];

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    box.classList.add("source");
    this.file = make("p", { className: "hint" });
    this.code = make("code");
    box.append(this.file, make("pre", { tabIndex: 0, "aria-label": "source text", "data-keys": "" }, this.code));
  }

  /** @param {string} file @param {string} text */
  put(file, text) {
    say(this.file, file);
    const parts = [];
    let from = 0;
    for (const match of text.matchAll(WORD)) {
      parts.push(
        text.slice(from, match.index),
        make("span", {
          className: KINDS[match.slice(1).findIndex((group) => group !== undefined)],
          textContent: match[0],
        }),
      );
      from = match.index + match[0].length;
    }
    this.code.replaceChildren(...parts, text.slice(from));
  }
}
