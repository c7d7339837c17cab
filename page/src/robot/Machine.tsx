// The picture of a machine of states, with the state that runs lit, and the arrow that led to it.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import type { JSX } from "preact";
import "./machine.css";

type Props = {
  /** An SVG document that Python drew: elib.tools.states.drawing. */
  svg: string;
  /** The state that runs and the one before; of a machine within another, both names with a dot. */
  states: readonly [now: string, before: string];
  /** What is selected, as a selector. */
  chosen?: string;
} & JSX.IntrinsicElements["div"];

const SMALLEST = 0.75; // of its own size, where there is little room; then it scrolls
const outer = (name: string) => name.split(".")[0];

export function Machine({ svg, states, chosen = "", ...rest }: Props) {
  const box = useRef<HTMLDivElement>(null),
    [now, before] = states.map(outer);
  useLayoutEffect(() => {
    const read = new DOMParser().parseFromString(svg, "image/svg+xml").documentElement,
      drawn = document.importNode(read, true),
      isLost = box.current!.contains(document.activeElement);
    drawn.style.minWidth = `${SMALLEST * Number(drawn.getAttribute("width"))}px`;
    box.current!.replaceChildren(drawn);
    if (isLost && chosen) box.current!.querySelector<SVGGElement>(chosen)?.focus();
  }, [svg]);
  useEffect(() => {
    const mark = (selector: string, kind: string) => {
      for (const each of box.current!.querySelectorAll(`.${kind}`)) each.classList.remove(kind);
      if (selector) for (const each of box.current!.querySelectorAll(selector)) each.classList.add(kind);
    };
    mark(chosen, "chosen");
    mark(now ? `[data-state="${now}"]` : "", "lit");
    mark(now && before ? `[data-source="${before}"][data-target="${now}"]` : "", "taken");
  });
  const seen = now ? `[data-state="${now}"]` : chosen;
  useEffect(() => {
    const within = box.current!,
      element = seen && within.querySelector(seen);
    if (!element) return;
    const one = element.getBoundingClientRect(),
      all = within.getBoundingClientRect();
    if (one.left < all.left || one.right > all.right)
      within.scrollLeft += (one.left + one.right - all.left - all.right) / 2;
    if (one.top < all.top || one.bottom > all.bottom)
      within.scrollTop += (one.top + one.bottom - all.top - all.bottom) / 2;
  }, [svg, seen]);
  return <div ref={box} class="machine" role="group" aria-label="states" {...rest} />;
}
