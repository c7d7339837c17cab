// Why a robot is not connected, what was checked, and what to try. It stands where the world would be.
import { Check, CircleAlert, Minus, TriangleAlert, type IconNode } from "lucide";
import { Copy } from "../look/Copy";
import { Icon } from "../look/Icon";
import type { DiagnosedStep } from "../messages";
import type { Robot } from "../store";

const MARKS: Record<DiagnosedStep["state"], [icon: IconNode, word: string, kind: string]> = {
  ok: [Check, "fine", "good"],
  warning: [TriangleAlert, "look at this", "warn"],
  failed: [CircleAlert, "failed", "bad"],
  skipped: [Minus, "not checked", "hint"],
};

/** An advice; a command at its end can be copied. */
function Advice({ text }: { text: string }) {
  const command = /: (elib .+)$/.exec(text)?.[1] ?? "";
  return (
    <div class="fix">
      <p>Try: {text.slice(0, text.length - command.length)}</p>
      {command && <Copy text={command} label="the command" />}
    </div>
  );
}

export function Trouble({ robot }: { robot: Robot }) {
  const { error, doctor, phase, phase_text } = robot.tick.value ?? {};
  if (!error)
    return (
      <div class="trouble stack">
        <h2>{phase_text ?? "Connecting …"}</h2>
        <p class="hint">Connect the robot to see where it goes, and to drive it.</p>
      </div>
    );
  const steps = doctor?.steps.filter(({ state }) => state !== "skipped") ?? [],
    skipped = doctor?.steps.filter(({ state }) => state === "skipped") ?? [];
  return (
    <div class="trouble stack">
      <h2>{error.message}</h2>
      {error.hint && !steps.some(({ fix }) => fix === error.hint) && <Advice text={error.hint} />}
      {!doctor && phase === "failed" && <p class="hint">Looking for the cause …</p>}
      {doctor && <p class="hint">What was checked:</p>}
      <ul class="doctor list">
        {steps.map(({ name, state, detail, fix }) => {
          const [icon, word, kind] = MARKS[state];
          return (
            <li key={name} class={state}>
              <span class={kind} role="img" aria-label={word}>
                <Icon of={icon} />
              </span>
              <b>{name}</b>
              {!error.message.endsWith(detail) && <span>{detail}</span>}
              {fix && <Advice text={fix} />}
            </li>
          );
        })}
      </ul>
      {skipped.length > 0 && (
        <details>
          <summary>Not checked because of that</summary>
          {skipped.map(({ name }) => name).join(", ")}
        </details>
      )}
    </div>
  );
}
