// What a click makes a robot show and play: lights, the colours of the e-puck2, and sounds.
import { Square, Volume2 } from "lucide";
import { Button, type ButtonProps } from "../look/Button";
import type { Robot } from "../store";
import { Body } from "./Body";

const ALL_LEDS = 8; // the number that means all of them
const STOP_SOUND = 0;

const byte = (share: number) =>
  Math.round(2.55 * share)
    .toString(16)
    .padStart(2, "0");
const hex = (shares: number[]) => `#${shares.map(byte).join("")}`;
const shares = (colour: string) =>
  [1, 3, 5].map((at) => Math.round((100 * parseInt(colour.slice(at, at + 2), 16)) / 255) / 100);

export function Lights({ robot }: { robot: Robot }) {
  const { phase, lamps } = robot.tick.value ?? {};
  if (!lamps) return null;
  const disabled = phase !== "connected",
    command = (name: string, ...values: number[]) => robot.ask("command", { name, arguments: values }),
    { coloured = [], sounds = [] } = robot.scheme.value ?? {};
  const button = (children: string, act: () => unknown, more: Partial<ButtonProps> = {}) => (
    <Button key={children} {...{ children, disabled, act, ...more }} />
  );
  const toggle = (text: string, name: string, isOn: boolean) =>
    button(text, () => command(name, Number(!isOn)), { "aria-pressed": isOn });
  return (
    <div class="lights stack">
      <Body robot={robot} />
      <h3>Lights</h3>
      <div class="row wrap" role="group" aria-label="lights">
        {button("All on", () => command("set_led", ALL_LEDS, 1), { "aria-label": "all ring LEDs on" })}
        {button("All off", () => command("set_led", ALL_LEDS, 0), { "aria-label": "all ring LEDs off" })}
        {toggle("Body", "set_body_led", Boolean(lamps.body))}
        {toggle("Front", "set_front_led", Boolean(lamps.front))}
        {button("Find it: blink", () => robot.ask("blink", {}), { title: "All LEDs blink for a moment" })}
      </div>
      {lamps.rgb && (
        <>
          <h3>Colours</h3>
          <div class="row wrap" role="group" aria-label="colours">
            {coloured.map((led) => {
              const colour = lamps.rgb![(led - 1) / 2];
              return (
                <label class="check" key={led}>
                  LED {led} {colour.some(Boolean) ? "" : "off"}
                  <input
                    type="color"
                    key={hex(colour)} // what is being chosen stays, until the robot has another
                    defaultValue={hex(colour)}
                    disabled={disabled}
                    aria-label={`colour of LED${led}`}
                    onChange={({ currentTarget }) => command("set_rgb_led", led, ...shares(currentTarget.value))}
                  />
                </label>
              );
            })}
          </div>
        </>
      )}
      <h3>Sounds</h3>
      <div class="row wrap" role="group" aria-label="sounds">
        {sounds.map((name, k) => button(name, () => command("play_sound", k + 1), { icon: Volume2 }))}
        {button("Stop sound", () => command("play_sound", STOP_SOUND), { icon: Square, weight: "quiet" })}
      </div>
    </div>
  );
}
