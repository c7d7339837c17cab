import { useSignal } from "@preact/signals";
import { Check, Copy as CopyIcon } from "lucide";
import { useRef } from "preact/hooks";
import { Button } from "./Button";
import "./Copy.css";

/** Lines to copy. Browsers keep their clipboard from pages of other computers: there the old way copies a selection. */
export function Copy({ text, label }: { text: string; label: string }) {
  const isDone = useSignal(false);
  const lines = useRef<HTMLPreElement>(null);
  const copy = async () => {
    if (navigator.clipboard) await navigator.clipboard.writeText(text);
    else {
      getSelection()?.selectAllChildren(lines.current!);
      document.execCommand("copy");
    }
    isDone.value = true;
    setTimeout(() => (isDone.value = false), 1500);
  };
  return (
    <div class="copy well">
      <pre ref={lines}>{text}</pre>
      <Button weight="quiet" icon={isDone.value ? Check : CopyIcon} label={`copy ${label}`} act={copy} />
    </div>
  );
}
