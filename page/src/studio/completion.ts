// What elib's names mean, in the editor: completion, an explanation under the mouse, and arguments while one types.
import { pickedCompletion, snippet, type Completion, type CompletionContext } from "@codemirror/autocomplete";
import { pythonLanguage } from "@codemirror/lang-python";
import { syntaxTree } from "@codemirror/language";
import { Prec, StateField, type EditorState } from "@codemirror/state";
import { EditorView, hoverTooltip, showTooltip, type Tooltip } from "@codemirror/view";
import { BASICS, known, type Known } from "./known";

const MODULES = "elib elib.behaviours elib.lab elib.learn elib.testing asyncio math random statistics time".split(" ");
/** How a program says that a name is a robot: it has the type, or comes from what opens one. */
const IS_ROBOT = /\b(\w+)(?:\s*:\s*(?:elib\.)?\w*Epuck\b|\s*=\s*(?:await\s+)?elib\.\w+\()|\bas\s+(\w+)\s*:/g;
/** How a program says what a name holds that it has read. */
const READ = /\b(\w+)\s*=\s*(?:await\s+)?\w+\.(\w+)\(/g;
const LOOK_BACK = 80; // letters before a name

/** The fields of what a name holds, if it holds what a robot has answered, as `near` in `near = robot.proximity()`. */
function fieldsOf(owner: string, text: string) {
  const signatureOf = (names: Known[], wanted?: string) => names.find(({ name }) => name === wanted)?.signature ?? "",
    method = Array.from(text.matchAll(READ)).findLast(([, each]) => each === owner)?.[2],
    [, type] = / -> (\w+)$/.exec(signatureOf(known.value.robot, method)) ?? [],
    fields = signatureOf(known.value.elib, type).matchAll(/[(,]\s*(\w+)/g);
  return Array.from(fields, ([, name]): Known => ({ name, signature: name, about: "", arguments: [], example: "" }));
}

/** What is known of the names behind a dot, as in `robot.stop` and `elib.connect`. */
function namesOf(owner: string, state: EditorState) {
  if (owner === "elib") return known.value.elib;
  const text = state.doc.toString(),
    robots = Array.from(text.matchAll(IS_ROBOT), ([, one, other]) => one ?? other);
  return ["robot", "begin", ...robots].includes(owner) ? known.value.robot : fieldsOf(owner, text);
}

/** What is known of the name that ends at a place. */
function namedAt(end: number, state: EditorState) {
  const [, owner, name] = /(\w+)\.(\w+)$/.exec(state.sliceDoc(Math.max(0, end - LOOK_BACK), end)) ?? [];
  return owner ? namesOf(owner, state).find((each) => each.name === name) : undefined;
}

/** What is known, as elements that hold only text. */
function explained({ signature, about, arguments: given, example }: Known) {
  const box = Object.assign(document.createElement("div"), { className: "known" }),
    add = (tag: string, textContent: string) => box.append(Object.assign(document.createElement(tag), { textContent }));
  add("code", signature);
  for (const text of [about, ...given.map((each) => each.join(": "))]) if (text) add("p", text);
  if (example) add("pre", example);
  return box;
}

const tooltip = (pos: number, each: Known): Tooltip => ({
  ...{ pos, above: true },
  create: () => ({ dom: explained(each) }),
});

function optionOf(each: Known): Completion {
  const { name: label, signature } = each,
    [, given] = /\((.*)\)/.exec(signature) ?? [],
    type = given === undefined ? "property" : "function",
    apply = given === undefined ? label : given ? snippet(`${label}(\${})`) : `${label}()`;
  return { label, type, apply, info: () => explained(each), boost: BASICS.includes(label) ? 1 : 0 };
}

function complete(context: CompletionContext) {
  const line = context.matchBefore(/^\s*(from|import)\b.*/)?.text,
    owner = context.matchBefore(/\w+\.\w*/)?.text.split(".")[0],
    isModule = line && !/\selib\s+import\b/.test(line),
    from = context.matchBefore(isModule ? /[\w.]+/ : /\w+/)?.from ?? context.pos,
    names = line ? known.value.elib.map(({ name }) => name) : [];
  if (!line && !owner) return null;
  const options = line
    ? (isModule ? MODULES : names).map((label) => ({ label }))
    : namesOf(owner!, context.state).map(optionOf);
  return { from, options, validFor: isModule ? /^[\w.]*$/ : /^\w*$/ };
}

/** What the innermost call around the cursor takes, if what it calls is known. */
function callAt(state: EditorState) {
  const at = state.selection.main.head;
  let node = syntaxTree(state).resolveInner(at, -1);
  const isAround = () =>
    node.name === "ArgList" && at > node.from && !(at === node.to && state.sliceDoc(at - 1, at) === ")");
  while (node.parent && !isAround()) node = node.parent;
  const found = node.parent && namedAt(node.from, state);
  return found ? tooltip(node.from, { ...found, about: "", example: "" }) : null;
}

/** Whether a completion was chosen last. One with brackets is not to get others from a hand that types them too. */
const hasChosen = StateField.define<boolean>({
  create: () => false,
  update: (_, change) => change.annotation(pickedCompletion) !== undefined,
});
const typedBracket = EditorView.inputHandler.of(
  ({ state }, from, _, text) => text === "(" && state.field(hasChosen) && /[()]/.test(state.sliceDoc(from - 1, from)),
);

export const help = [
  hasChosen,
  Prec.high(typedBracket),
  pythonLanguage.data.of({ autocomplete: complete }),
  hoverTooltip(({ state }, at) => {
    const word = state.wordAt(at),
      found = word && namedAt(word.to, state);
    return found ? tooltip(word.from, found) : null;
  }),
  StateField.define<Tooltip | null>({
    create: () => null,
    update: (shown, { docChanged, selection, state }) => (docChanged || (selection && shown) ? callAt(state) : shown),
    provide: (field) => showTooltip.from(field),
  }),
];
