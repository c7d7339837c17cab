// What a state does, and when an arrow is taken, as forms: each change of a field is an edit of the text.
import * as icons from "lucide";
import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Check, Select } from "../look/fields";
import { chosen, edit, forms, machine } from "./machine";
import type { Condition, ItemNews } from "./messages";
import { shownLine } from "./run";

const COMPARISONS = Object.entries({ "<": "below", ">": "above", "==": "is", "!=": "is not" });
const ALWAYS = "always", AFTER = "after", PYTHON = "python"; // prettier-ignore

type FieldProps = { label: string; value: string; rule?: string; change: (to: string) => unknown };

/** A field that makes its edit when it is left, or Enter is pressed. */
function Field({ label, value, rule = "", change }: FieldProps) {
  const input = useRef<HTMLInputElement>(null);
  useLayoutEffect(() => void (input.current!.value = value), [value]); // and not while one types
  return (
    <label class="field">
      <span class="hint">{label}</span>
      <input
        {...{ ref: input, title: rule, placeholder: rule, spellcheck: false }}
        onChange={({ currentTarget }) => currentTarget.value !== value && change(currentTarget.value.trim())}
      />
    </label>
  );
}

const Line = ({ line }: { line: number }) => (
  <Button weight="quiet" act={() => (shownLine.value = { line })} class="line" children={`line ${line}`} />
);

function Item({ state, item, number }: { state: string; item: ItemNews; number: number }) {
  const form = forms.value.actions.find(({ name }) => name === item.command),
    set = (name: string, value: string) => edit("set_action", { state, item: number, arguments: { [name]: value } });
  if (item.kind === "arrow") return null;
  return (
    <li class="row wrap">
      {item.on_entry && <span class="hint">first</span>}
      {item.kind === "code" ? (
        <code title={item.text}>{item.text.split("\n")[0]}</code>
      ) : (
        <b>{item.command.replaceAll("_", " ")}</b>
      )}
      {item.kind === "look" && <span class="hint">is read</span>}
      {item.kind === "action" &&
        form?.arguments.map(([name, rule]) => (
          <Field
            key={name}
            label={name}
            value={item.arguments[name] ?? ""}
            rule={rule}
            change={(to) => set(name, to)}
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

function NewAction({ state }: { state: string }) {
  const isFirst = useSignal(true);
  const add = (command: string) => {
    const form = forms.value.actions.find(({ name }) => name === command)!,
      given = Object.fromEntries(form.arguments.map(([name, , value]) => [name, value]));
    return edit("add_action", { state, command, arguments: given, on_entry: isFirst.value });
  };
  return (
    <div class="row wrap">
      <Select
        {...{ "aria-label": "add an action", value: "" }}
        choices={[
          ["", "Add an action …"],
          ...forms.value.actions.map((each) => [each.name, each.name.replaceAll("_", " ")] as const),
        ]}
        choose={(command) => command && add(command)}
      />
      <Check isOn={isFirst.value} act={(to) => (isFirst.value = to)}>
        when it begins
      </Check>
    </div>
  );
}

export function StateForm({ state }: { state: string }) {
  const found = machine.value!.states.find(({ name }) => name === state),
    arrows = machine
      .value!.arrows.map((each, number) => ({ ...each, number }))
      .filter(({ source }) => source === state);
  if (!found) return null;
  const rename = async (name: string) =>
    (await edit("rename_state", { state, name })) && (chosen.value = { state: name });
  return (
    <form class="stack form" aria-label={`state ${state}`} onSubmit={(event) => event.preventDefault()}>
      <Field label="State" value={state} change={rename} />
      {found.about && <p class="hint">{found.about}</p>}
      <ul class="list">
        {found.items.map((item, number) => (
          <Item key={number} {...{ state, item, number }} />
        ))}
      </ul>
      <NewAction key={found.items.length} state={state} />
      <ul class="list">
        {arrows.map(({ number, words, target }) => (
          <li key={number}>
            <Button weight="quiet" icon={icons.MoveRight} act={() => (chosen.value = { arrow: number })}>
              {words}: {target}
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

export function ArrowForm({ arrow }: { arrow: number }) {
  const found = machine.value!.arrows[arrow];
  if (!found) return null;
  const { readings } = forms.value,
    { condition: it, test } = found,
    kind = !test ? ALWAYS : !it ? PYTHON : it.reading || AFTER,
    reading = readings.find(({ name }) => name === it?.reading),
    field = reading?.fields.find(({ path }) => path === it!.path),
    isNumber = !!it && !isNaN(Number(it.value)),
    scale = (isNumber && field?.scale) || 1,
    shown = it && (isNumber ? String(Number((Number(it.value) * scale).toPrecision(6))) : it.value),
    set = (condition: Condition | string) => edit("set_condition", { arrow, condition }),
    change = (part: Partial<Condition>) => set({ ...it!, ...part });
  const choose = (to: string) => {
    const first = readings.find(({ name }) => name === to)?.fields[0];
    if (to === ALWAYS) return set("");
    if (to === PYTHON) return set(test || "run.time_in_state > 1");
    if (to === AFTER) return set({ reading: "", path: "", comparison: ">", value: "1" });
    return set({
      reading: to,
      path: first!.path,
      comparison: first!.unit === "cm" ? "<" : ">",
      value: first!.unit === "cm" ? "0.04" : "1",
    });
  };
  const kinds = [[ALWAYS, "always"], [AFTER, "after a time"], ...readings.map(({ name, title }) => [name, title]), [PYTHON, "in Python"]] as [string, string][]; // prettier-ignore
  const targets = [...machine.value!.states.map(({ name }) => name), "end"];
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
          <label class="field">
            <span class="hint">When</span>
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
                choices={COMPARISONS}
                choose={(comparison) => change({ comparison: comparison as Condition["comparison"] })}
              />
            </div>
          )}
          {it && (
            <Field
              label={it.reading ? field?.unit || "value" : "seconds"}
              value={shown!}
              change={(to) =>
                change({ value: to && !isNaN(Number(to)) ? String(Number((Number(to) / scale).toPrecision(6))) : to })
              }
            />
          )}
          {kind === PYTHON && <Field label="Python" value={test} change={set} />}
        </>
      ) : (
        <p class="hint">This way stands in code that a form cannot say.</p>
      )}
      <p class="hint">{found.words}</p>
      <Line line={found.line} />
    </form>
  );
}
