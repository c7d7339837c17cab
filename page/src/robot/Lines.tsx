import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import "./lists.css";

/** A list that grows, and fills the panel; it scrolls down to what is new if *news* says what that is. */
export function Lines({ label, news, children }: { label: string; news?: unknown; children: ComponentChildren }) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (news) box.current!.scrollTop = box.current!.scrollHeight;
  }, [news]);
  return (
    <div class="lines well" ref={box} tabIndex={0} role="log" aria-label={label} data-keys="">
      {children}
    </div>
  );
}
