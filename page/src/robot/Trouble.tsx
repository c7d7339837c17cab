// Why a robot is not connected, what to try, and what was checked. It stands where the world would be.
import { Check, CircleAlert, Minus, Plug, TriangleAlert, type IconNode } from "lucide";
import { Button } from "../look/Button";
import { Copy } from "../look/Copy";
import { Icon } from "../look/Icon";
import type { DiagnosedStep } from "../messages";
import { go } from "../route";
import { can, type Robot } from "../store";

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
      <p>{text.slice(0, text.length - command.length)}</p>
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
  const steps = doctor ?? [],
    advice = [error.hint, ...steps.map(({ fix }) => fix)].filter(Boolean);
  return (
    <div class="trouble stack">
      <h2>The robot did not answer</h2>
      <p>{error.message}</p>
      {!doctor && phase === "failed" && <p class="hint">Looking for the cause …</p>}
      {advice.length > 0 && (
        <>
          <h3>Try this</h3>
          <ol>
            {[...new Set(advice)].map((text) => (
              <li key={text}>
                <Advice text={text} />
              </li>
            ))}
          </ol>
        </>
      )}
      {can().connect && phase === "failed" && (
        <div class="row wrap">
          <Button weight="primary" icon={Plug} act={() => robot.ask("connect", {})}>
            Try again
          </Button>
          <Button act={() => go("#/start")}>Another robot, or a virtual one</Button>
        </div>
      )}
      {steps.length > 0 && (
        <details>
          <summary>What was checked</summary>
          <ul class="doctor list">
            {steps.map(({ name, state, detail }) => {
              const [icon, word, kind] = MARKS[state];
              return (
                <li key={name} class={state}>
                  <span class={kind} role="img" aria-label={word}>
                    <Icon of={icon} />
                  </span>
                  <b>{name}</b>
                  <span>{state === "skipped" ? "not checked because of that" : detail}</span>
                </li>
              );
            })}
          </ul>
        </details>
      )}
    </div>
  );
}
