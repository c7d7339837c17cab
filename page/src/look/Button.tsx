import { useSignal } from "@preact/signals";
import type { IconNode } from "lucide";
import type { ComponentChildren, JSX } from "preact";
import { Icon } from "./Icon";

type Own = {
  weight?: "primary" | "plain" | "quiet" | "stop";
  icon?: IconNode;
  /** Name of a button that shows an icon alone; it is its tooltip, too. */
  label?: string;
  act: () => unknown;
  children?: ComponentChildren;
};
export type ButtonProps = Own & Omit<JSX.IntrinsicElements["button"], keyof Own | "icon" | "onClick">;

/** A button. While what it asks for waits for an answer, it says so, and asks for nothing more. */
export function Button({ weight = "plain", icon, label, act, children, class: more = "", ...rest }: ButtonProps) {
  const isBusy = useSignal(false);
  const press = async () => {
    if (isBusy.value) return;
    isBusy.value = true;
    try {
      await act();
    } finally {
      isBusy.value = false;
    }
  };
  return (
    <button
      type="button"
      class={`${weight} ${icon && !children ? "icon" : ""} ${more}`}
      aria-label={label}
      title={label}
      aria-busy={isBusy.value || undefined}
      onClick={press}
      {...rest}
    >
      {icon && <Icon of={icon} />}
      {children}
    </button>
  );
}
