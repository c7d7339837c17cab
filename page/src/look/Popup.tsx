import "./Popup.css";
import type { IconNode } from "lucide";
import type { ComponentChildren } from "preact";
import { Icon } from "./Icon";

type Props = { icon: IconNode; label: string; children: ComponentChildren };

/** What is seldom needed, behind a button: it opens over the page, so that nothing moves under the hand. */
export const Popup = ({ icon, label, children }: Props) => (
  <details class="popup">
    <summary class="button quiet" title={label} aria-label={label}>
      <Icon of={icon} />
    </summary>
    <div class="card stack">{children}</div>
  </details>
);
