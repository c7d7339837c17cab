// CodeMirror to write in: breakpoints beside the lines, the line that runs, and what went wrong below its line.
import { autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { python } from "@codemirror/lang-python";
import { bracketMatching, indentOnInput, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { searchKeymap } from "@codemirror/search";
import { EditorState, RangeSet, StateEffect, StateField, type Extension } from "@codemirror/state";
import {
  Decoration,
  drawSelection,
  EditorView,
  gutter,
  GutterMarker,
  highlightActiveLine,
  keymap,
  lineNumbers,
  WidgetType,
  type DecorationSet,
} from "@codemirror/view";
import { colours, look } from "../look/codeMirror";
import { help } from "./completion";
import type { Mistake, Program } from "./messages";

const lookToWriteIn = EditorView.theme({
  ".cm-cursor": { borderLeftColor: "var(--ink)", borderLeftWidth: "2px" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {
    background: "var(--tint)",
  },
  ".cm-activeLine": { background: "color-mix(in srgb, var(--hover) 55%, transparent)" },
  ".cm-breakpoints .cm-gutterElement": { width: "18px", cursor: "pointer" },
  ".cm-breakpoints .cm-gutterElement > span, .cm-breakpoints .cm-gutterElement:hover::after": {
    display: "block",
    width: "10px",
    height: "10px",
    margin: "5px 4px",
    borderRadius: "50%",
    background: "var(--bad)",
    content: "''",
  },
  ".cm-breakpoints .cm-gutterElement:hover::after": { opacity: "0.35" },
  ".cm-breakpoints .cm-gutterElement:has(span):hover::after": { display: "none" },
  ".cm-runs": { background: "var(--tint)" },
  ".cm-paused": { background: "var(--tint)", boxShadow: "inset 3px 0 var(--accent)" },
  ".cm-wrong": { background: "var(--bad-tint)", boxShadow: "inset 3px 0 var(--bad)" },
  ".cm-mistake": {
    padding: "6px 12px 8px",
    background: "var(--bad-tint)",
    boxShadow: "inset 3px 0 var(--bad)",
    color: "var(--ink)",
    font: "var(--small)/1.45 var(--font)",
    whiteSpace: "pre-wrap",
  },
  ".cm-mistake b": { color: "var(--bad)" },
  ".cm-tooltip": {
    maxWidth: "min(460px, 92vw)",
    border: "1px solid var(--line)",
    borderRadius: "var(--round)",
    background: "var(--card)",
    boxShadow: "var(--lifted)",
    color: "var(--ink)",
  },
  ".cm-tooltip .known": { padding: "6px 10px", font: "var(--small)/1.45 var(--font)", maxWidth: "440px" },
  ".known > *": { margin: "0 0 3px" },
  ".known :is(code, pre)": { fontFamily: "var(--mono)", whiteSpace: "pre-wrap" },
  ".known > pre": { color: "var(--faint)" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { background: "var(--accent)", color: "var(--on-accent)" },
  ".cm-panels": { background: "var(--card)", color: "var(--ink)" },
  ".cm-matchingBracket": { background: "var(--tint)", outline: "1px solid var(--control)" },
});

// -- breakpoints --

const toggle = StateEffect.define<number>({ map: (at, changes) => changes.mapPos(at) });

const dot = new (class extends GutterMarker {
  toDOM() {
    return document.createElement("span");
  }
})();

const breakpoints = StateField.define<RangeSet<GutterMarker>>({
  create: () => RangeSet.empty,
  update(dots, { changes, effects, state }) {
    let found = dots.map(changes);
    for (const effect of effects) {
      if (!effect.is(toggle)) continue;
      let isThere = false;
      found.between(effect.value, effect.value, () => void (isThere = true));
      found = found.update(
        isThere
          ? { filter: (from) => from !== effect.value }
          : { add: [dot.range(state.doc.lineAt(effect.value).from)] },
      );
    }
    return found;
  },
});

/** The lines with a breakpoint. */
function linesOf(state: EditorState) {
  const found = new Set<number>();
  for (let cursor = state.field(breakpoints).iter(); cursor.value; cursor.next())
    found.add(state.doc.lineAt(cursor.from).number);
  return [...found];
}

const flip = (view: EditorView, at: number) => {
  view.dispatch({ effects: toggle.of(view.state.doc.lineAt(at).from) });
  return true;
};

// -- the line that runs, and the one that is wrong --

const show = StateEffect.define<Program>();

class Explained extends WidgetType {
  constructor(private readonly mistake: Mistake) {
    super();
  }

  override eq(other: Explained) {
    return other.mistake === this.mistake;
  }

  toDOM() {
    const box = document.createElement("div"),
      { kind, message, hint } = this.mistake,
      add = (tag: string, text: string) =>
        box.append(Object.assign(document.createElement(tag), { textContent: text }));
    box.className = "cm-mistake";
    box.role = "alert";
    add("b", kind);
    add("span", message && `: ${message}`);
    if (hint) add("div", `What to try: ${hint}`);
    return box;
  }
}

const lit = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(shown, { changes, effects, state, startState: { doc } }) {
    const found = effects.find((effect) => effect.is(show))?.value as Program | undefined,
      isMended = (from: number) => changes.touchesRange(from, doc.lineAt(from).to);
    if (!found) return shown.update({ filter: (from) => !isMended(from) }).map(changes);
    const { state: how, line, mistake } = found,
      wanted = how === "idle" ? mistake?.line : line;
    if (!wanted || wanted > state.doc.lines) return Decoration.none;
    const { from, to } = state.doc.line(wanted),
      name = how === "idle" ? "cm-wrong" : how === "paused" ? "cm-paused" : "cm-runs",
      lines = [Decoration.line({ class: name }).range(from)];
    if (how === "idle" && mistake)
      lines.push(Decoration.widget({ widget: new Explained(mistake), block: true, side: 1 }).range(to));
    return Decoration.set(lines);
  },
  provide: (field) => EditorView.decorations.from(field),
});

// -- the editor --

export type Told = { edit: (text: string) => void; points: (lines: number[]) => void };

export class Editor {
  private readonly view: EditorView;
  private readonly extensions: Extension;

  constructor(root: ShadowRoot, label: string, told: Told) {
    this.extensions = [
      breakpoints,
      gutter({
        class: "cm-breakpoints",
        markers: (view) => view.state.field(breakpoints),
        initialSpacer: () => dot,
        domEventHandlers: { mousedown: (view, { from }) => flip(view, from) },
      }),
      lineNumbers({ domEventHandlers: { mousedown: (view, { from }) => flip(view, from) } }),
      lit,
      history(),
      drawSelection(),
      indentOnInput(),
      indentUnit.of("    "),
      bracketMatching(),
      closeBrackets(),
      autocompletion({ icons: false }),
      highlightActiveLine(),
      keymap.of([
        { key: "F9", run: (view) => flip(view, view.state.selection.main.head) },
        ...closeBracketsKeymap,
        ...completionKeymap,
        ...searchKeymap,
        ...historyKeymap,
        indentWithTab,
        ...defaultKeymap,
      ]),
      EditorView.contentAttributes.of({ "aria-label": label, spellcheck: "false" }),
      EditorView.updateListener.of(({ docChanged, startState, state }) => {
        if (docChanged) told.edit(state.doc.toString());
        if (startState.field(breakpoints, false) !== state.field(breakpoints)) told.points(linesOf(state));
      }),
      python(),
      help,
      syntaxHighlighting(colours),
      look,
      lookToWriteIn,
    ];
    this.view = new EditorView({ root, parent: root });
  }

  /** Show another program: what was undone and where it pauses belong to the one before. */
  open(doc: string) {
    this.view.setState(EditorState.create({ doc, extensions: this.extensions }));
  }

  /** Show how the program stands; where it paused or went wrong is brought into view. */
  show(program: Program) {
    const line = program.state === "running" ? null : (program.line ?? program.mistake?.line);
    this.view.dispatch({ effects: show.of(program) });
    if (line) this.lookAt(line);
  }

  lookAt(line: number, isChosen = false) {
    const { doc } = this.view.state,
      { from } = doc.line(Math.max(1, Math.min(line, doc.lines)));
    if (isChosen) this.view.dispatch({ selection: { anchor: from } });
    this.view.dispatch({ effects: EditorView.scrollIntoView(from, { y: "nearest", yMargin: 60 }) });
    if (isChosen) this.view.focus();
  }

  focus() {
    this.view.focus();
  }

  close() {
    this.view.destroy();
  }
}
