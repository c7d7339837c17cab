// What elib's names mean, in the editor: completion, an explanation under the mouse, and arguments while one types.
import { snippet, type Completion, type CompletionContext } from "@codemirror/autocomplete";
import { pythonLanguage } from "@codemirror/lang-python";
import { syntaxTree } from "@codemirror/language";
import { StateField, type EditorState } from "@codemirror/state";
import { hoverTooltip, showTooltip, type Tooltip } from "@codemirror/view";
import { known, type Known } from "./known";

const MODULES = "elib elib.behaviours elib.lab elib.learn elib.testing asyncio math random statistics time".split(" ");
/** How a program says that a name is a robot: it has the type, or comes from what opens one. */
const IS_ROBOT = /\b(\w+)(?:\s*:\s*(?:elib\.)?\w*Epuck\b|\s*=\s*(?:await\s+)?elib\.\w+\()|\bas\s+(\w+)\s*:/g;

/** What is known of the names behind a dot, as in `robot.stop` and `elib.connect`. */
function namesOf(owner: string, state: EditorState) {
  if (owner === "elib") return known.value.elib;
  const robots = Array.from(state.doc.toString().matchAll(IS_ROBOT), ([, one, other]) => one ?? other);
  return ["robot", "begin", ...robots].includes(owner) ? known.value.robot : [];
}

/** What is known of the name at the end of a text such as "if robot.stop". */
function meantBy(text: string, state: EditorState) {
  const [, owner, name] = /(\w+)\.(\w+)$/.exec(text) ?? [];
  return owner ? namesOf(owner, state).find((each) => each.name === name) : undefined;
}

/** What is known, as elements that hold only text. */
function explained({ signature, about, arguments: given, example }: Known) {
  const box = document.createElement("div"),
    add = (tag: string, text: string) => box.append(Object.assign(document.createElement(tag), { textContent: text }));
  box.className = "known";
  add("code", signature);
  add("p", about);
  for (const [name, rule] of given) add("p", `${name}: ${rule}`);
  if (example) add("pre", example);
  return box;
}

function optionOf(each: Known): Completion {
  const { name: label, signature } = each,
    [, given] = /\((.*)\)/.exec(signature) ?? [],
    type = given === undefined ? "property" : "function",
    apply = given === undefined ? label : given ? snippet(`${label}(\${})`) : `${label}()`;
  return { label, type, apply, info: () => explained(each) };
}

function complete(context: CompletionContext) {
  const line = context.matchBefore(/^\s*(from|import)\b.*/)?.text,
    word = context.matchBefore(/\w+/),
    owner = context.matchBefore(/\w+\.\w*/)?.text.split(".")[0],
    from = word?.from ?? context.pos;
  if (line && /\selib\s+import\b/.test(line)) {
    const options = known.value.elib.map(({ name, about }) => ({ label: name, info: about }));
    return { from, options, validFor: /^\w*$/ };
  }
  if (line)
    return {
      from: context.matchBefore(/[\w.]+/)?.from ?? from,
      options: MODULES.map((label) => ({ label, type: "namespace" })),
      validFor: /^[\w.]*$/,
    };
  return owner ? { from, options: namesOf(owner, context.state).map(optionOf), validFor: /^\w*$/ } : null;
}

/** The innermost call around the cursor, if what it calls is known. */
function callAt(state: EditorState): Tooltip | null {
  const at = state.selection.main.head;
  for (let node = syntaxTree(state).resolveInner(at, -1); node.parent; node = node.parent) {
    if (node.name !== "ArgList" || at === node.from) continue;
    if (at === node.to && state.sliceDoc(at - 1, at) === ")") continue;
    const found = meantBy(state.sliceDoc(Math.max(0, node.from - 80), node.from), state),
      start = node.from;
    return found ? { pos: start, above: true, create: () => ({ dom: explained({ ...found, example: "" }) }) } : null;
  }
  return null;
}

export const help = [
  pythonLanguage.data.of({ autocomplete: complete }),
  hoverTooltip((view, at) => {
    const word = view.state.wordAt(at),
      found = word && meantBy(view.state.sliceDoc(Math.max(0, word.from - 80), word.to), view.state);
    return found ? { pos: word.from, end: word.to, above: true, create: () => ({ dom: explained(found) }) } : null;
  }),
  StateField.define<Tooltip | null>({
    create: () => null,
    update: (shown, { docChanged, selection, state }) =>
      docChanged || (selection && shown) ? callAt(state) : shown && !selection ? shown : null,
    provide: (field) => showTooltip.from(field),
  }),
];
