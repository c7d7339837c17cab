// What is known of the selected thing, or of the whole world, and what can be switched there.
import { signal } from "@preact/signals";
import { RotateCcw, RotateCw } from "lucide";
import type { ComponentChildren } from "preact";
import { useRef } from "preact/hooks";
import type { LinkFaults } from "../messages";
import { Button } from "../look/Button";
import { can } from "../store";
import type { Orders } from "./orders";
import { degrees, TOUCHING, type Order, type World } from "./scene";

type Text = (value: number) => string;

const SENSORS = [
  "front right",
  "diagonal right",
  "right",
  "rear right",
  "rear left",
  "left",
  "diagonal left",
  "front left",
];
const REMOTE = ["sound", "", "forward", "", "left", "stop", "right", "", "back", ""]; // what the e-puck1 does at a key
const DARK = 4095; // counts of a light sensor without any light
const TURN = Math.PI / 12;
const NEWER = 5; // frames after an answer until readings are surely of after it
const share: Text = (value) => `${Math.round(100 * value)} %`;
const milliseconds: Text = (value) => `${Math.round(1000 * value)} ms`;
const metres: Text = (value) => `${value.toFixed(3)} m`;
const FAULTS: [key: keyof LinkFaults, label: string, high: number, text: Text][] = [
  ["loss", "Answers lost", 1, share],
  ["latency", "Delay of answers", 1, milliseconds],
  ["jitter", "Delay varies by ±", 0.5, milliseconds],
];
const unfolded = signal(["Infrared sensors"]); // it outlives what is selected

/** Asks for changes, and lets a control show what was asked for until news from after the answer are here. */
class Held {
  private values = new Map<string, { value: unknown; until: number }>();

  constructor(
    private readonly world: World,
    private readonly orders: Orders,
  ) {}

  private get now() {
    return this.world.frame.value?.number ?? 0;
  }

  shown<T>(key: string, actual: T): T {
    const held = this.values.get(key);
    return held && this.now < held.until ? (held.value as T) : actual;
  }

  async ask(key: string, value: unknown, order: Order) {
    this.values.set(key, { value, until: Infinity });
    if ((await this.orders.act(order)) === null) return; // one of its kind is under way, which ends this, too
    const held = this.values.get(key);
    if (held) held.until = this.now + NEWER;
  }
}

type Props = { world: World; orders: Orders; turn: (by: number) => void };

export function Details({ world, orders, turn }: Props) {
  const held = useRef<Held>(null);
  held.current ??= new Held(world, orders);
  const thing = world.selected.value,
    { scene, things, ambient } = world;
  const slider = (key: string, label: string, high: number, actual: number, text: Text, order: Order) => (
    <Slider {...{ name: key, label, high, text, order, held: held.current! }} actual={actual} />
  );
  const facts: Record<string, string> = {};
  if (thing && (thing.kind !== "robot" || world.frame.value)) {
    const [x, y, angle] = world.pose(thing);
    Object.assign(facts, { x: metres(x), y: metres(y) });
    if (thing.kind === "robot") Object.assign(facts, { heading: `${degrees(angle)}°` }, motion(world, thing.index));
    if (thing.kind === "box" || thing.kind === "wall") facts.angle = `${degrees(angle)}°`;
    if (thing.kind === "box") {
      const { width, depth, height } = things.value.box[thing.index] ?? { width: 0, depth: 0, height: 0 };
      facts.size = [width, depth, height].map((each) => `${Math.round(100 * each)}`).join(" × ") + " cm";
    }
  } else if (scene.value) {
    const { world: name, width, depth, robots } = scene.value;
    Object.assign(facts, { world: name, size: `${+width.toFixed(2)} × ${+depth.toFixed(2)} m`, robots: `${robots}` });
  }
  return (
    <>
      <select
        aria-label="thing in the world"
        value={thing?.key ?? ""}
        onChange={(event) => world.select(world.find(event.currentTarget.value))}
      >
        <option value="">whole world</option>
        {world.all().map(({ key, name }) => (
          <option key={key} value={key}>
            {name}
          </option>
        ))}
      </select>
      <dl>
        {Object.entries(facts).map(([name, text]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{text}</dd>
          </div>
        ))}
      </dl>
      {can().edit && (
        <>
          {!thing &&
            slider("ambient", "Light in the room", DARK, ambient.value, brightness, { do: "set_ambient", ambient: 0 })}
          {thing && ["robot", "box", "wall"].includes(thing.kind) && (
            <div class="row">
              <Button icon={RotateCcw} aria-label="turn left by 15 degrees" act={() => turn(TURN)}>
                15°
              </Button>
              <Button icon={RotateCw} aria-label="turn right by 15 degrees" act={() => turn(-TURN)}>
                15°
              </Button>
            </div>
          )}
          {thing?.kind === "light" &&
            slider(
              "intensity",
              "Brightness",
              10,
              things.value.light[thing.index]?.intensity,
              (value) => value.toFixed(1),
              {
                do: "set_light",
                light: thing.index,
              },
            )}
          {thing?.kind === "sound" &&
            slider(
              "volume",
              "Volume at 0.1 m",
              4095,
              things.value.sound[thing.index]?.volume,
              (value) => `${Math.round(value)}`,
              {
                do: "set_sound",
                sound: thing.index,
              },
            )}
        </>
      )}
      {thing?.kind === "robot" && <Sensors world={world} index={thing.index} />}
      {thing?.kind === "robot" && can().edit && (
        <>
          <Link world={world} orders={orders} held={held.current} index={thing.index} />
          <Hands world={world} orders={orders} held={held.current} index={thing.index} />
        </>
      )}
    </>
  );
}

const brightness: Text = (counts) => share(1 - counts / DARK);

function motion({ speeds, frame, readings }: World, index: number) {
  const [left, right] = readingsOf(readings.value, index)?.encoders ?? ["–", "–"],
    signless = (text: string) => text.replace(/^-(?=0(\.0)?$)/, "");
  return {
    speed: `${signless((100 * speeds[2 * index]).toFixed(1))} cm/s`,
    turning: `${signless(((speeds[2 * index + 1] * 180) / Math.PI).toFixed(0))} °/s`,
    "wheel steps": `left ${left}, right ${right}`,
    "touches something": frame.value && frame.value.bits[index] & TOUCHING ? "yes" : "no",
  };
}

const readingsOf = (readings: World["readings"]["value"], index: number) =>
  readings?.robot === index ? readings : null;

type SliderProps = { name: string; label: string; high: number; actual: number; text: Text; order: Order; held: Held };

function Slider({ name, label, high, actual = 0, text, order, held }: SliderProps) {
  const value = held.shown(name, actual),
    id = `knob-${name}`,
    step = high > 100 ? 5 : high > 1 ? 0.1 : 0.01;
  // An output is something a label can be for, too: without its name the label would be the output's.
  return (
    <label
      class="slider"
      for={id}
      title={name === "ambient" ? "The light sensors of a robot read a higher number where it is darker." : ""}
    >
      {label}
      <output>{text(value)}</output>
      <input
        type="range"
        id={id}
        min={0}
        max={high}
        step={step}
        dir={name === "ambient" ? "rtl" : undefined /* counted as sensors do, low for bright: bright is at the right */}
        value={value}
        aria-valuetext={text(value)}
        onInput={({ currentTarget: { valueAsNumber } }) =>
          held.ask(name, valueAsNumber, { ...order, [name]: valueAsNumber } as Order)
        }
      />
    </label>
  );
}

function Group({ title, children }: { title: string; children: ComponentChildren }) {
  const others = unfolded.value.filter((each) => each !== title);
  return (
    <details
      open={unfolded.value.includes(title)}
      onToggle={(event) => (unfolded.value = event.currentTarget.open ? [...others, title] : others)}
    >
      <summary>{title}</summary>
      {children}
    </details>
  );
}

function Sensors({ world, index }: { world: World; index: number }) {
  const proximity = readingsOf(world.readings.value, index)?.proximity;
  return (
    <Group title="Infrared sensors">
      <p class="hint">True values, without noise</p>
      <div class="bars" role="group" aria-label="infrared sensors, counts">
        {SENSORS.map((name, number) => (
          <>
            <span>{`IR${number} ${name}`}</span>
            <meter aria-hidden="true" min={0} max={DARK} value={proximity?.[number] ?? 0} />
            <span>{proximity?.[number] ?? "–"}</span>
          </>
        ))}
      </div>
    </Group>
  );
}

type RobotProps = { world: World; orders: Orders; held: Held; index: number };

function Link({ world, orders, held, index }: RobotProps) {
  const { link, base } = readingsOf(world.readings.value, index) ?? {},
    isCut = held.shown("cut", link?.cut ?? false),
    added = FAULTS.filter(([key]) => base && base[key] > 0).map(
      ([key, label, , text]) => `${label.toLowerCase()} ${text(base![key])}`,
    );
  const notes = [
    added.length && `The robot's URL adds: ${added.join(", ")}.`,
    link?.script.length && `The fault script does now: ${link.script.join(", ")}.`,
    link && !link.connected && !link.cut && "No program has opened this robot yet.",
  ];
  const mend = async () => {
    await orders.send({ do: "set_faults", robot: index, loss: 0, latency: 0, jitter: 0 });
    if (isCut) await orders.send({ do: "mend", robot: index });
  };
  return (
    <Group title="Link of this robot">
      <Check
        id="world-link"
        label="Cut the link"
        isOn={isCut}
        act={(isOn) => held.ask("cut", isOn, { do: isOn ? "cut" : "mend", robot: index })}
      />
      {FAULTS.map(([key, label, high, text]) => (
        <Slider
          key={key}
          {...{ name: key, label, high, text, held }}
          actual={link?.[key] ?? 0}
          order={{ do: "set_faults", robot: index }}
        />
      ))}
      <p class="hint">{notes.filter(Boolean).join(" ")}</p>
      <Button act={mend}>Undo all faults</Button>
    </Group>
  );
}

/** What a hand can do to the robot itself. */
function Hands({ world, orders, held, index }: RobotProps) {
  const { selector, button } = readingsOf(world.readings.value, index) ?? {},
    key = useRef<HTMLSelectElement>(null);
  return (
    <Group title="Robot's controls">
      <label class="switch">
        Selector
        <select
          id="world-selector"
          value={held.shown("selector", selector ?? 0)}
          onChange={({ currentTarget: { value } }) =>
            held.ask("selector", Number(value), { do: "turn_selector", robot: index, position: Number(value) })
          }
        >
          {Array.from({ length: 16 }, (_, position) => (
            <option key={position}>{position}</option>
          ))}
        </select>
      </label>
      <div class="switch">
        Remote control
        <select ref={key} aria-label="key of the remote control">
          {REMOTE.map((what, number) => (
            <option key={number} value={number}>{`${number} ${what}`}</option>
          ))}
        </select>
        <Button act={() => orders.send({ do: "press_remote", robot: index, key: Number(key.current!.value) })}>
          Press
        </Button>
      </div>
      {typeof button === "boolean" && (
        <Check
          id="world-button"
          label="User button held down"
          isOn={held.shown("button", button)}
          act={(isOn) => held.ask("button", isOn, { do: "press_button", robot: index, pressed: isOn })}
        />
      )}
    </Group>
  );
}

function Check({ id, label, isOn, act }: { id: string; label: string; isOn: boolean; act: (isOn: boolean) => void }) {
  return (
    <label class="switch">
      {label}
      <input
        type="checkbox"
        role="switch"
        id={id}
        checked={isOn}
        onChange={(event) => act(event.currentTarget.checked)}
      />
    </label>
  );
}
