// CodeMirror to write in: breakpoints beside the lines, the line that runs, and what went wrong below its line.
import { autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab, undo } from "@codemirror/commands";
import { python } from "@codemirror/lang-python";
import { bracketMatching, indentOnInput, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { searchKeymap } from "@codemirror/search";
import { EditorState, RangeSet, StateEffect, StateField, type ChangeSpec } from "@codemirror/state";
import * as view from "@codemirror/view";
import { effect } from "@preact/signals";
import { colours, look } from "../look/codeMirror";
import { help } from "./completion";
import type { ProgramNews } from "./messages";
import { edit, opened } from "./programs";
import { breakpoints, here, shownLine } from "./run";

const LABEL = "program; Tab indents, Escape and then Tab leaves the editor";
const MARGIN = 60; // pixels above a line that is scrolled to
const POINT = ".cm-breakpoints .cm-gutterElement";
const NOTE = { display: "block", padding: "4px 0 6px", color: "var(--bad)", font: "var(--small)/1.45 var(--font)" };

const lookToWriteIn = view.EditorView.theme({
  "&.cm-focused": { outline: "none" }, // the box has one
  ".cm-cursor": { borderLeft: "2px solid var(--ink)" },
  "&.cm-focused .cm-selectionBackground, .cm-selectionBackground": { background: "var(--tint) !important" },
  ".cm-activeLine": { background: "color-mix(in srgb, var(--hover) 55%, transparent)" },
  [POINT]: { width: "18px", cursor: "pointer", color: "var(--bad)", textAlign: "center" },
  [`${POINT}:not(:has(span)):hover::after`]: { content: "'●'", opacity: "0.35" },
  ".cm-runs": { background: "var(--tint)" },
  ".cm-paused": { background: "var(--tint)", boxShadow: "inset 3px 0 var(--accent)" },
  ".cm-wrong": { background: "var(--bad-tint)", boxShadow: "inset 3px 0 var(--bad)" },
  ".cm-wrong::after": { ...NOTE, content: "attr(data-note)", whiteSpace: "pre-wrap" },
  ".cm-tooltip": { border: "1px solid var(--line)", background: "var(--card)", boxShadow: "var(--lifted)" },
  ".cm-tooltip, .cm-panels": { background: "var(--card)", color: "var(--ink)" },
  "&:not(.cm-focused) .cm-tooltip.known": { display: "none" }, // of the call in which nobody writes any more
  ".cm-tooltip.known, .cm-tooltip .known": {
    padding: "6px 10px",
    maxWidth: "min(440px, 90vw)",
    font: "var(--small)/1.45 var(--font)",
  },
  ".known > *": { margin: "0 0 3px", whiteSpace: "pre-wrap" },
  ".known > :is(code, pre)": { fontFamily: "var(--mono)" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { background: "var(--accent)", color: "var(--on-accent)" },
});

/** At each line with a breakpoint. */
const point = new (class extends view.GutterMarker {
  toDOM = () => Object.assign(document.createElement("span"), { textContent: "●" });
})();
const toggle = StateEffect.define<number>({ map: (at, changes) => changes.mapPos(at) });
const points = StateField.define<RangeSet<view.GutterMarker>>({
  create: () => RangeSet.empty,
  update: (old, { changes, effects, state }) =>
    effects.reduce((found, each) => {
      if (!each.is(toggle)) return found;
      const at = state.doc.lineAt(each.value).from,
        others = found.update({ filter: (from) => from !== at });
      return others.size < found.size ? others : found.update({ add: [point.range(at)] });
    }, old.map(changes)),
});

function linesOf(state: EditorState) {
  const lines = new Set<number>();
  state.field(points).between(0, state.doc.length, (from) => void lines.add(state.doc.lineAt(from).number));
  return [...lines];
}

function flip(editor: view.EditorView, { from }: { from: number }) {
  editor.dispatch({ effects: toggle.of(editor.state.doc.lineAt(from).from) });
  return true;
}

const placeOf = ({ state, line, mistake }: ProgramNews) => (state === "idle" ? mistake?.line : line);

/** The line that runs, where the program is paused, or that is wrong until it is changed. */
const show = StateEffect.define<ProgramNews>();
const lit = StateField.define<view.DecorationSet>({
  create: () => view.Decoration.none,
  update(old, { changes, effects, state, startState: { doc } }) {
    const told = effects.find((each) => each.is(show))?.value as ProgramNews | undefined;
    if (!told) return old.update({ filter: (at) => !changes.touchesRange(at, doc.lineAt(at).to) }).map(changes);
    const { mistake } = told,
      wanted = placeOf(told);
    if (!wanted || wanted > state.doc.lines) return view.Decoration.none;
    const note = mistake
        ? `${mistake.kind}: ${mistake.message}${mistake.hint && `\nWhat to try: ${mistake.hint}`}`
        : "",
      kind = { running: "cm-runs", paused: "cm-paused", idle: "cm-wrong" }[told.state],
      spec = { class: kind, attributes: { "data-note": note } };
    return view.Decoration.set(view.Decoration.line(spec).range(state.doc.line(wanted).from));
  },
  provide: (field) => view.EditorView.decorations.from(field),
});

const click = { domEventHandlers: { mousedown: flip } };
const extensions = [
  points,
  view.gutter({
    class: "cm-breakpoints",
    markers: ({ state }) => state.field(points),
    initialSpacer: () => point,
    ...click,
  }),
  view.lineNumbers(click),
  lit,
  history(),
  view.drawSelection(),
  view.highlightActiveLine(),
  view.EditorView.lineWrapping,
  view.EditorView.contentAttributes.of({ "aria-label": LABEL }),
  indentOnInput(),
  indentUnit.of("    "),
  bracketMatching(),
  closeBrackets(),
  autocompletion({ icons: false }),
  view.keymap.of([
    { key: "F9", run: (editor) => flip(editor, editor.state.selection.main) },
    ...[closeBracketsKeymap, completionKeymap, searchKeymap, historyKeymap, [indentWithTab], defaultKeymap].flat(),
  ]),
  view.EditorView.updateListener.of(({ docChanged, startState, state }) => {
    if (docChanged) edit(state.doc.toString());
    if (startState.field(points, false) !== state.field(points)) breakpoints.value = linesOf(state);
  }),
  python(),
  help,
  syntaxHighlighting(colours),
  lookToWriteIn, // before the other one, which it changes
  look,
];

let shown: view.EditorView;

/** Change the text as one step that can be undone. */
export const change = (changes: ChangeSpec) => shown.dispatch({ changes, userEvent: "input.states" });
/** Scroll to a line, and set the cursor there; the page stays where it is if only the text is to be scrolled. */
export function lookAt(line: number, inText = false) {
  const anchor = shown.state.doc.line(Math.max(1, Math.min(line, shown.state.doc.lines))).from;
  shown.dispatch({
    selection: { anchor },
    effects: inText ? [] : view.EditorView.scrollIntoView(anchor, { yMargin: MARGIN }),
  });
  if (inText) shown.scrollDOM.scrollTop = shown.lineBlockAt(anchor).top - MARGIN;
}
export const undoInText = () => undo(shown);

/** Let a person write the program that is open, in a box; it follows how the program stands. */
export function editIn(box: HTMLElement) {
  const root = box.attachShadow({ mode: "open" }),
    editor = (shown = new view.EditorView({ root, parent: root }));
  // What was undone and where it pauses belong to the program that was open before.
  effect(() => {
    editor.setState(EditorState.create({ doc: opened.value.text, extensions }));
    breakpoints.value = [];
  });
  effect(() => {
    const at = placeOf(here.value);
    editor.dispatch({ effects: show.of(here.value) });
    if (at && here.value.state !== "running") lookAt(at);
  });
  effect(() => {
    if (!shownLine.value) return;
    lookAt(shownLine.value.line);
    editor.focus();
  });
}
