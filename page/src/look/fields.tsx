// What a form is made of, and lists of facts.
import type { ComponentChildren, JSX } from "preact";

type Choices = readonly (readonly [value: string | number, text: ComponentChildren])[];
type SelectProps = { choices: Choices; choose: (value: string) => unknown } & JSX.IntrinsicElements["select"];

export const Select = ({ choices, choose, ...rest }: SelectProps) => (
  <select {...rest} onChange={({ currentTarget }) => choose(currentTarget.value)}>
    {choices.map(([value, text]) => (
      <option key={value} value={value}>
        {text}
      </option>
    ))}
  </select>
);

type CheckProps = {
  isOn: boolean;
  act: (isOn: boolean) => unknown;
  id?: string;
  role?: "switch";
  disabled?: boolean;
  class?: string;
  style?: Record<string, string>;
  children: ComponentChildren;
};

/** A box to tick, with what stands beside it. */
export const Check = ({ isOn, act, class: more = "", style, children, ...rest }: CheckProps) => (
  <label class={`check ${more}`} style={style}>
    <input type="checkbox" {...rest} checked={isOn} onChange={({ currentTarget }) => act(currentTarget.checked)} />
    {children}
  </label>
);

/** Facts with their names, one below the other. */
export const Facts = ({ of, class: more = "" }: { of: (readonly [string, string | number])[]; class?: string }) => (
  <dl class={more}>
    {of.map(([name, text]) => (
      <div key={name} class="row">
        <dt class="fill hint">{name}</dt>
        <dd>{text}</dd>
      </div>
    ))}
  </dl>
);
