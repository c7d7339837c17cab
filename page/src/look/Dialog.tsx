import { signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "./Button";

type Question = { title: string; yes: string; body: ComponentChildren; answer: (wants: boolean) => void };

const question = signal<Question | null>(null);

/** Ask a person, with fields in *body* if something has to be filled in; return whether they want it. */
export const confirmed = (title: string, yes: string, body: ComponentChildren) =>
  new Promise<boolean>((answer) => {
    question.value?.answer(false);
    question.value = { title, yes, body, answer };
  });

/** The dialog of `confirmed`. STOP stands in it, because the one of the header cannot be reached while it is open. */
export function Dialog({ stop }: { stop: (() => void) | undefined }) {
  const asked = question.value;
  const box = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    if (asked) box.current?.showModal();
  }, [asked]);
  if (!asked) return null;
  const close = () => {
    question.value = null;
    asked.answer(box.current?.returnValue === "yes");
  };
  return (
    <dialog ref={box} aria-label={asked.title} onClose={close}>
      <form method="dialog" class="stack">
        <h2>{asked.title}</h2>
        {asked.body}
        <div class="row wrap">
          <button class="primary" value="yes">
            {asked.yes}
          </button>
          <button class="plain" value="no" formNoValidate>
            Cancel
          </button>
          <span class="fill" />
          {stop && (
            <Button weight="stop" act={stop}>
              STOP
            </Button>
          )}
        </div>
      </form>
    </dialog>
  );
}
