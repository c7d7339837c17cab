import type { IconNode } from "lucide";
import type { ComponentChildren } from "preact";
import { useId } from "preact/hooks";
import { Icon } from "./Icon";
import "./Menu.css";

type Props = { icon: IconNode; text: string; title?: string; disabled?: boolean; children: ComponentChildren };

/** Close what is open over the page. */
export const closeMenu = () => document.querySelector<HTMLElement>(":popover-open")?.hidePopover();

/** What opens below a button, over the page; Escape, and a click elsewhere, close it. */
export function Menu({ icon, text, children, ...rest }: Props) {
  const id = useId();
  return (
    <>
      <button type="button" class="plain menu" popovertarget={id} {...rest}>
        <Icon of={icon} /> <span class="short">{text}</span>
      </button>
      <div id={id} popover="auto" class="card stack">
        {children}
      </div>
    </>
  );
}
