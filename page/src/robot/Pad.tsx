// Driving: the pad, who drives, how fast, and how fast it may be.
import { useSignal } from "@preact/signals";
import { SlidersHorizontal } from "lucide";
import { useEffect, useId, useMemo } from "preact/hooks";
import { Button } from "../look/Button";
import { confirmed } from "../look/Dialog";
import { Check } from "../look/fields";
import { arrowsMove } from "../look/keys";
import { Popup } from "../look/Popup";
import { number } from "../look/text";
import type { Tick } from "../messages";
import { can, hello, type Robot } from "../store";
import { Hands, mayDrive, type Wheels } from "./hands";
import "./Pad.css";

const REACH = 78; // of the knob's middle in the drawing, whose edge is at 105
const SETTLED = 1000; // ms after the limit was moved in which it shows what was asked for
const HAS_KEYS = !matchMedia("(pointer: coarse), (max-width: 720px)").matches; // a phone has none
const SIDES = ["left", "right"] as const;

/** A stick to pull; the yellow dot shows how the robot moves. */
function Stick({ hands, echo, help }: { hands: Hands; echo: Wheels; help: string }) {
  const [x, y] = hands.knob.value ?? [0, 0],
    [left, right] = echo;
  const pull = ({ currentTarget, clientX, clientY }: PointerEvent) => {
    const box = (currentTarget as Element).getBoundingClientRect(),
      reach = (box.width / 2) * (REACH / 105);
    hands.push([(clientX - box.left - box.width / 2) / reach, -(clientY - box.top - box.height / 2) / reach]);
  };
  const letGo = () => hands.push(null);
  return (
    <div
      class={`pad ${hands.knob.value ? "on" : ""}`}
      tabIndex={0}
      role="application"
      aria-label="driving pad; arrow keys or W A S D drive, space stops"
      aria-describedby={help}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        pull(event);
      }}
      onPointerMove={(event) => hands.isHeld && pull(event)}
      onPointerUp={letGo}
      onPointerCancel={letGo}
      onLostPointerCapture={letGo}
    >
      <svg viewBox="-105 -105 210 210" aria-hidden="true">
        <circle r="100" fill="var(--sunken)" />
        <circle r="58" />
        <path d="M-78,0H-14M14,0H78M0,-78V-14M0,14V78" />
        <g stroke="var(--faint)" stroke-width="3" stroke-linecap="round">
          {[0, 90, 180, 270].map((turn) => (
            <path key={turn} d="M-8,-83L0,-91L8,-83" transform={`rotate(${turn})`} />
          ))}
        </g>
        <circle r="26" class="knob" cx={REACH * x} cy={-REACH * y} />
        {(left !== 0 || right !== 0) && (
          <g fill="var(--motion)" stroke="var(--tyre)">
            <circle r="7" cx={(REACH / 2) * (left - right)} cy={(-REACH / 2) * (left + right)} />
          </g>
        )}
      </svg>
    </div>
  );
}

function Sliders({ hands, isOff }: { hands: Hands; isOff: boolean }) {
  const stays = useSignal(false);
  const set = (wheel: number, share: number) =>
    hands.slide(wheel ? [hands.sliders.value[0], share] : [share, hands.sliders.value[1]]);
  return (
    <>
      {SIDES.map((side, wheel) => {
        const spring = () => stays.value || set(wheel, 0);
        const slide = {
          value: 100 * hands.sliders.value[wheel],
          onInput: ({ currentTarget }: InputEvent) =>
            set(wheel, Number((currentTarget as HTMLInputElement).value) / 100),
          ...{ onPointerUp: spring, onPointerCancel: spring, onBlur: spring },
        };
        return (
          <label class="field" key={side}>
            {side} wheel, percent of the limit
            <input type="range" min={-100} max={100} step={5} disabled={isOff} {...slide} />
          </label>
        );
      })}
      <Check disabled={isOff} isOn={stays.value} act={(isOn) => (stays.value = isOn)}>
        Sliders stay where I put them
      </Check>
    </>
  );
}

function Limit({ robot, limit, isOff }: { robot: Robot; limit: number; isOff: boolean }) {
  const asked = useSignal({ share: limit, at: -Infinity }),
    share = performance.now() - asked.value.at < SETTLED ? asked.value.share : limit,
    { fastest = 1, circumference = 0 } = robot.scheme.value ?? {};
  return (
    <label class="limit">
      <span class="hint" title={`${number(share * fastest, 2)} rev/s`}>
        Speed limit
      </span>
      <output title={`${Math.round(100 * share)} %`}>{number(100 * share * fastest * circumference, 1)} cm/s</output>
      <input
        type="range"
        min={5}
        max={100}
        step={5}
        value={Math.round(100 * share)}
        aria-label="speed limit, percent of the fastest"
        title="It holds for the pad, the keys and the gamepad. Behaviours drive as fast as they want."
        disabled={isOff}
        onInput={({ currentTarget }) => {
          asked.value = { share: currentTarget.valueAsNumber / 100, at: performance.now() };
          robot.tell("limit", { share: asked.value.share });
        }}
      />
    </label>
  );
}

function whoDrives({ phase, drive }: Tick, isMine: boolean, behaviour: string) {
  if (phase !== "connected" && phase !== "gap") return "Connect the robot to drive it.";
  if (drive.driver && !isMine) return "Another browser drives this robot.";
  if (isMine) return "You drive.";
  if (behaviour) return `${behaviour} drives. Touch the pad to pause it.`;
  if (drive.may_move) return "The robot is moving.";
  return HAS_KEYS ? "To drive, use the pad or W\u00a0A\u00a0S\u00a0D." : "To drive, use the pad.";
}

async function takeOver(robot: Robot) {
  const text = (
    <p>Another browser drives this robot. The robot stops first. Then you drive, and the other person watches.</p>
  );
  if (await confirmed("Take over?", "Take over", text)) await robot.ask("take_over", {});
}

export function Pad({ robot }: { robot: Robot }) {
  const hands = useMemo(() => new Hands(robot), [robot]),
    help = useId();
  useEffect(() => hands.open(), [hands]);
  const tick = robot.tick.value,
    { fastest = 1, circumference = 0 } = robot.scheme.value ?? {},
    play = robot.play.value;
  if (!can().drive) return <p class="hint">This page only watches.</p>;
  if (!tick) return null;
  const { drive } = tick,
    isOff = !mayDrive(tick),
    isMine = drive.driver !== "" && drive.driver === hello.value?.page,
    speeds = [drive.left ?? 0, drive.right ?? 0];
  // Where the knob stands, if a hand drives; otherwise a share of the fastest.
  const scale = Math.max(1e-6, (isMine ? drive.limit : 1) * fastest);
  return (
    <div class="drive" data-off={isOff ? "yes" : "no"}>
      <Stick hands={hands} echo={[speeds[0] / scale, speeds[1] / scale]} help={help} />
      <div class="who row">
        <p class="driver fill" role="status">
          {whoDrives(tick, isMine, play?.phase === "running" ? play.name : "")}
        </p>
        <Popup icon={SlidersHorizontal} label="more to drive with">
          <Sliders hands={hands} isOff={isOff} />
          <p class="hint" id={help}>
            {arrowsMove.value
              ? `Arrow keys move ${arrowsMove.value} now. W\u00a0A\u00a0S\u00a0D drive.`
              : "Arrow keys or a gamepad drive it, too."}
          </p>
          <p class="hint">{hands.gamepad}</p>
        </Popup>
      </div>
      <div class="beside stack">
        {drive.driver && !isMine && !isOff && <Button act={() => takeOver(robot)}>Take over …</Button>}
        <p class="speeds">
          {SIDES.map((side, wheel) => (
            <span key={side} title={`${number(speeds[wheel], 2)} rev/s`}>
              <span class="hint">{side}</span> {number(100 * speeds[wheel] * circumference, 1)} cm/s
            </span>
          ))}
        </p>
        <Limit robot={robot} limit={drive.limit} isOff={isOff} />
      </div>
    </div>
  );
}
