// What a state does, and when an arrow is taken, as forms: each change of a field is an edit of the text.
import * as icons from "lucide";
import { useLayoutEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Select } from "../look/fields";
import { chosen, edit, forms, machine } from "./machine";
import type { ArgumentForm, Condition, ItemNews, PartNews } from "./messages";
import { shownLine } from "./run";

const COMPARISONS = Object.entries({ "<": "below", ">": "above", "==": "is", "!=": "is not" });
const SEEN = Object.entries({ seen: "is seen", "not seen": "is not seen" });
const PICTURE = "image"; // the reading of a camera: a form looks for a colour in it
const ALWAYS = "always";
const PYTHON = "python";
const TIMES = [[".time_in_state", "after a time in this state"], [".time", "after a time from the start"]]; // prettier-ignore

type FieldProps = { label: string; value: string; rule?: string; change: (to: string) => unknown };

/** A field that makes its edit when it is left, or Enter is pressed. */
function Field({ label, value, rule = "", change }: FieldProps) {
  const input = useRef<HTMLInputElement>(null);
  useLayoutEffect(() => void (input.current!.value = value), [value]); // and not while one types
  return (
    <label class="field" title={rule}>
      <span class="hint">{label}</span>
      <input
        {...{ ref: input, spellcheck: false }}
        onChange={({ currentTarget }) => currentTarget.value !== value && change(currentTarget.value.trim())}
      />
    </label>
  );
}

/** A number in another unit, short; in the same one it stays as it is. */
const scaled = (number: number, scale: number) =>
  String(scale === 1 ? number : Number((number * scale).toPrecision(4)));

/** A number of the program in the unit of a person; what is no number stays Python. */
function Quantity({ label, value, scale, change, ...rest }: FieldProps & { scale: number }) {
  const isNumber = value !== "" && !isNaN(Number(value)),
    back = (text: string) => text.replace(/^(-?\d+),(\d+)$/, "$1.$2");
  return (
    <Field
      {...{ label, ...rest, value: isNumber ? scaled(Number(value), scale) : value }}
      change={(to) => change(to && !isNaN(Number(back(to))) ? scaled(Number(back(to)), 1 / scale) : to)}
    />
  );
}

const Line = ({ line }: { line: number }) => (
  <Button weight="quiet" act={() => (shownLine.value = { line })} class="line" children={`line ${line}`} />
);

function Argument({ form, value, change }: { form: ArgumentForm; value: string; change: (to: string) => unknown }) {
  const { name, rule, unit, scale, choices } = form,
    label = [name.replaceAll("_", " "), unit].filter(Boolean).join(", ");
  if (!choices.length) return <Quantity {...{ label, value, rule, scale, change }} />;
  const words = choices.map((each) => [each, each.slice(1, -1)] as const);
  return (
    <label class="field">
      <span class="hint">{label}</span>
      <Select {...{ value: value.replaceAll('"', "'"), choose: change, choices: words }} />
    </label>
  );
}

function Item({ state, item, number }: { state: string; item: ItemNews; number: number }) {
  const form = forms.value.actions.find(({ name }) => name === item.command),
    set = (name: string, value: string) => edit("set_action", { state, item: number, arguments: { [name]: value } }),
    isKnown = item.kind === "action" && form;
  return (
    <li class="row wrap">
      {isKnown ? <b>{item.command.replaceAll("_", " ")}</b> : <code title={item.text}>{item.text.split("\n")[0]}</code>}
      {isKnown &&
        form.arguments
          .filter(({ name, value }) => value || item.arguments[name])
          .map((each) => (
            <Argument
              key={each.name}
              form={each}
              value={item.arguments[each.name] ?? ""}
              change={(to) => set(each.name, to)}
            />
          ))}
      {item.kind === "code" ? (
        <Line line={item.line} />
      ) : (
        <Button weight="quiet" icon={icons.X} label="Remove" act={() => edit("remove_item", { state, item: number })} />
      )}
    </li>
  );
}

/** What a state does when it begins, or all the time. */
function Items({ state, items, onEntry }: { state: string; items: ItemNews[]; onEntry: boolean }) {
  const add = (command: string) => {
    const form = forms.value.actions.find(({ name }) => name === command)!,
      given = Object.fromEntries(form.arguments.map(({ name, value }) => [name, value]));
    return edit("add_action", { state, command, arguments: given, on_entry: onEntry });
  };
  const choices = forms.value.actions.map(({ name }) => [name, name.replaceAll("_", " ")] as const);
  return (
    <section aria-label={onEntry ? "when it begins" : "in each step"}>
      <h3>{onEntry ? "When it begins" : "In each step, 20 times a second"}</h3>
      <ul class="list">
        {items.map((item, number) => {
          const isHere = item.on_entry === onEntry && (item.kind === "action" || item.kind === "code");
          return isHere && <Item key={number} {...{ state, item, number }} />;
        })}
      </ul>
      <Select
        key={items.length}
        {...{ "aria-label": "add an action", value: "" }}
        choices={[["", "Add an action …"], ...choices]}
        choose={(command) => command && add(command)}
      />
    </section>
  );
}

export function StateForm({ state }: { state: string }) {
  const found = machine.value!.states.find(({ name }) => name === state),
    arrows = machine
      .value!.arrows.map((each, number) => ({ ...each, number }))
      .filter(({ source }) => source === state);
  if (!found) return null;
  const rename = async (typed: string) => {
    const name = typed.replaceAll(/[\s-]+/g, "_");
    if (await edit("rename_state", { state, name })) chosen.value = { state: name };
  };
  return (
    <form class="stack form" aria-label={`state ${state}`} onSubmit={(event) => event.preventDefault()}>
      <Field label="State" value={state} change={rename} />
      {found.about && <p class="hint">{found.about}</p>}
      <Items {...{ state, items: found.items, onEntry: true }} />
      <Items {...{ state, items: found.items, onEntry: false }} />
      <ul class="list">
        {arrows.map(({ number, words, target }) => (
          <li key={number}>
            <Button weight="quiet" icon={icons.MoveRight} act={() => (chosen.value = { arrow: number })}>
              {target}: {words}
            </Button>
          </li>
        ))}
      </ul>
      <div class="row wrap">
        <Line line={found.line} />
        {machine.value!.start !== state && (
          <Button weight="quiet" act={() => edit("set_start", { state })} children="Begin here" />
        )}
      </div>
    </form>
  );
}

/** One of the conditions that must all hold for an arrow, as a form. */
function Part({ arrow, part, parts }: { arrow: number; part: number; parts: PartNews[] }) {
  const { readings } = forms.value,
    { condition: it, test } = parts[part] ?? { condition: null, test: "" },
    kind = !test ? ALWAYS : !it ? PYTHON : it.reading || it.path,
    reading = readings.find(({ name }) => name === it?.reading),
    field = reading?.fields.find(({ path }) => path === it!.path),
    set = (condition: Condition | string) => edit("set_condition", { arrow, condition, part }),
    change = (changed: Partial<Condition>) => set({ ...it!, ...changed }),
    isColour = it?.reading === PICTURE,
    others = (!isColour && reading?.fields.filter(({ path }) => path !== it!.path)) || [],
    isOther = others.some(({ path }) => path === it!.value);
  const choose = (to: string) => {
    const first = readings.find(({ name }) => name === to)?.fields[0];
    if (to === ALWAYS) return set("");
    if (to === PYTHON) return set(test || "run.time_in_state > 1");
    if (!first) return set({ reading: "", path: to, comparison: ">", value: "1" });
    if (to === PICTURE) return set({ reading: to, path: first.path, comparison: "seen", value: "" });
    return set({
      reading: to,
      path: first.path,
      comparison: first.unit === "cm" ? "<" : ">",
      value: first.unit === "cm" ? "0.04" : "1",
    });
  };
  const none = parts.length > 1 ? "(take this away)" : ALWAYS,
    kinds = [[ALWAYS, none], ...TIMES, ...readings.map(({ name, title }) => [name, title]), [PYTHON, "in Python"]] as [string, string][]; // prettier-ignore
  return (
    <section class="stack" aria-label={`condition ${part + 1}`}>
      <label class="field">
        <span class="hint">{part ? "and" : "When"}</span>
        <Select value={kind} choices={kinds} choose={choose} />
      </label>
      {it && field && (
        <div class="row wrap">
          {reading!.fields.length > 1 && (
            <Select
              {...{ "aria-label": "which", value: it.path }}
              choices={reading!.fields.map(({ path, label }) => [path, label] as const)}
              choose={(path) => change({ path })}
            />
          )}
          <Select
            {...{ "aria-label": "comparison", value: it.comparison }}
            choices={isColour ? SEEN : COMPARISONS}
            choose={(comparison) => change({ comparison: comparison as Condition["comparison"] })}
          />
        </div>
      )}
      {others.length > 0 && (
        <Select
          {...{ "aria-label": "compared with", value: isOther ? it!.value : "" }}
          choices={[["", "a number"], ...others.map(({ path, label }) => [path, label] as const)]}
          choose={(value) => change({ value: value || "1" })}
        />
      )}
      {it && !isOther && !isColour && (
        <Quantity
          label={it.reading ? field?.unit || "value" : "seconds"}
          {...{ value: it.value, scale: field?.scale ?? 1, change: (value) => change({ value }) }}
        />
      )}
      {kind === PYTHON && <Field label="Python" value={test} change={set} />}
    </section>
  );
}

export function ArrowForm({ arrow }: { arrow: number }) {
  const found = machine.value!.arrows[arrow];
  if (!found) return null;
  const { parts } = found,
    targets = [...machine.value!.states.map(({ name }) => name), "end"],
    more: Condition = { reading: "", path: TIMES[0][0], comparison: ">", value: "1" };
  return (
    <form class="stack form" aria-label="arrow" onSubmit={(event) => event.preventDefault()}>
      <label class="field">
        <span class="hint">From {found.source} to</span>
        <Select
          value={found.target}
          choices={targets.map((each) => [each, each] as const)}
          choose={(target) => edit("retarget", { arrow, target })}
        />
      </label>
      {found.is_plain ? (
        <>
          {(parts.length ? parts : [null]).map((_, part) => (
            <Part key={part} {...{ arrow, part, parts }} />
          ))}
          {parts.length > 0 && (
            <Button
              weight="quiet"
              icon={icons.Plus}
              act={() => edit("set_condition", { arrow, condition: more, part: parts.length })}
              children="And …"
            />
          )}
        </>
      ) : (
        <p class="hint">This way stands in code that a form cannot say.</p>
      )}
      <p class="hint">{found.words}</p>
      <Line line={found.line} />
    </form>
  );
}
