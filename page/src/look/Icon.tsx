import type { IconNode } from "lucide";
import { h } from "preact";

/** One of lucide's icons, in the colour of the text beside it. What it means is said by the control that it stands in. */
export const Icon = ({ of, size = 18 }: { of: IconNode; size?: number }) => (
  <svg
    class="icon"
    viewBox="0 0 24 24"
    width={size}
    height={size}
    fill="none"
    stroke="currentColor"
    stroke-width="1.9"
    stroke-linecap="round"
    stroke-linejoin="round"
    aria-hidden="true"
  >
    {of.map(([tag, attributes]) => h(tag, attributes))}
  </svg>
);
