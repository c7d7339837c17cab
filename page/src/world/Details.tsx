// What is known of the selected thing, or of the whole world, and what can be switched there.
import { signal, useSignal } from "@preact/signals";
import { RotateCcw, RotateCw } from "lucide";
import type { ComponentChildren } from "preact";
import { useRef } from "preact/hooks";
import { FRAME, type LinkFaults, type Readings } from "../messages";
import { Button } from "../look/Button";
import { Check, Facts, Select } from "../look/fields";
import { milliseconds, number } from "../look/text";
import type { Orders } from "./orders";
import { degrees, type Order, type World } from "./scene";

const SIDES = "front right,diagonal right,right,rear right,rear left,left,diagonal left,front left".split(",");
const REMOTE = ["sound", "", "forward", "", "left", "stop", "right", "", "back", ""]; // what the e-puck1 does at a key
const POSITIONS = Array.from({ length: 16 }, (_, position) => [position, position] as const); // of the selector
const DARK = 4095; // counts of a light sensor without any light
const TURN = Math.PI / 12;
const NEWER = 5; // frames after an answer until readings are surely of after it
const share = (value: number) => `${Math.round(100 * value)} %`;
const inRoom = (counts: number) => share(1 - counts / DARK);

/** A slider from 0: the name of its value in orders, its label, its highest value, how it is written, and a hint. */
type Knob<Name = string> = [name: Name, label: string, high: number, text: (value: number) => string, title?: string];
const FAULTS: Knob<keyof LinkFaults>[] = [
  ["loss", "Answers lost", 1, share],
  ["latency", "Delay of answers", 1, milliseconds],
  ["jitter", "Delay varies by ±", 0.5, milliseconds],
];
/** What can break: its name, how it is called, the names of its numbers if each can break alone, and their unit. */
const PARTS: [of: string, label: string, numbers: string[], unit: string][] = [
  ["proximity", "IR#", SIDES, "counts"],
  ["ambient_light", "IR#, ambient,", SIDES, "counts"],
  ["ground", "ground", ["left", "centre", "right", "cliff left", "cliff right"], "counts"],
  ["microphones", "microphone", ["right", "left", "rear", "front"], "counts"],
  ["distance", "distance", [], "m"],
  ["accelerometer", "accelerometer", [], "m/s²"],
  ["gyroscope", "gyroscope", [], "rad/s"],
  ["magnetometer", "magnetometer", [], "µT"],
  ["camera", "camera", [], "of 255"],
  ["wheel", "wheel", ["left", "right"], ""],
  ["clock", "clock", [], ""],
];
const PART_CHOICES = PARTS.flatMap(([of, label, names]) =>
  names.length
    ? names.map((name, k) => [`${of} ${k}`, `${label.replace("#", `${k}`)} ${name}`] as const)
    : [[of, label] as const],
);
const ROOM: Knob = ["ambient", "Light in the room", DARK, inRoom, "Light sensors read more where it is darker."];
const LAMP: Knob = ["intensity", "Brightness", 10, (value) => value.toFixed(1)];
const NOISE: Knob = ["volume", "Volume at 0.1 m", DARK, (value) => `${Math.round(value)}`];
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
  const { kind, index = 0, key = "" } = world.selected.value ?? {},
    { light, sound } = world.things.value,
    isPast = world.past.value !== null,
    readings = world.readings.value?.robot === index && !isPast ? world.readings.value : undefined,
    shared = { orders, held: held.current, readings, robot: index };
  const sliders: Record<string, [of: Knob, actual: number | undefined, order: Order]> = {
    "": [ROOM, world.ambient.value, { do: "set_ambient", ambient: 0 }],
    light: [LAMP, light[index]?.intensity, { do: "set_light", light: index }],
    sound: [NOISE, sound[index]?.volume, { do: "set_sound", sound: index }],
  };
  const [of, actual, order] = sliders[kind ?? ""] ?? [];
  return (
    <>
      <Select
        aria-label="thing in the world"
        value={key}
        choices={[["", "whole world"], ...world.all().map(({ key, name }) => [key, name] as const)]}
        choose={(chosen) => world.select(world.find(chosen))}
      />
      <Facts of={facts(world, readings)} />
      {orders.mayEdit && ["robot", "box", "wall"].includes(kind ?? "") && (
        <div class="row">
          <Button icon={RotateCcw} aria-label="turn left by 15 degrees" act={() => turn(TURN)} children="15°" />
          <Button icon={RotateCw} aria-label="turn right by 15 degrees" act={() => turn(-TURN)} children="15°" />
        </div>
      )}
      {orders.mayEdit && of && order && <Slider {...shared} {...{ of, actual, order }} />}
      {kind === "robot" && <Sensors proximity={readings?.proximity} />}
      {kind === "robot" && orders.mayEdit && (
        <>
          <Link {...shared} />
          <Parts {...shared} />
          <Hands {...shared} />
        </>
      )}
    </>
  );
}

/** What is known, each with its name. */
function facts(world: World, readings?: Readings): [name: string, text: string][] {
  const thing = world.selected.value,
    { scene, frame, speeds, things } = world;
  if (!thing) {
    const { world: name, width, depth, robots } = scene.value!;
    return [
      ["world", name],
      ["size", `${+width.toFixed(2)} × ${+depth.toFixed(2)} m`],
      ["robots", `${robots}`],
    ];
  }
  const { kind, index } = thing,
    [x, y, angle] = world.pose(thing),
    found: [string, string][] = [
      ["x", `${number(x, 3)} m`],
      ["y", `${number(y, 3)} m`],
    ];
  if (kind === "box" || kind === "wall") found.push(["angle", `${degrees(angle)}°`]);
  const box = kind === "box" && things.value.box[index];
  if (box)
    found.push(["size", [box.width, box.depth, box.height].map((each) => number(100 * each, 1)).join(" × ") + " cm"]);
  if (kind !== "robot") return found;
  const [left, right] = readings?.encoders ?? ["–", "–"];
  found.push(["heading", `${degrees(angle)}°`]);
  if (world.past.value !== null) return found; // the rest is known of now alone
  return [
    ...found,
    ["speed", `${number(100 * speeds[2 * index], 1)} cm/s`],
    ["turning", `${number(Math.round((speeds[2 * index + 1] * 180) / Math.PI))} °/s`],
    ["wheel steps", `left ${left}, right ${right}`],
    ...earned(readings),
    ["touches something", (frame.value?.bits[index] ?? 0) & FRAME.touching ? "yes" : "no"],
  ];
}

/** What a robot has earned and used, where the world has such a thing. */
function earned({ energy, score, zones } = { energy: 1, score: 0, zones: [] } as Partial<Readings>) {
  const found: [string, string][] = [];
  if (energy! < 1) found.push(["energy", `${Math.round(100 * energy!)} %`]);
  if (score) found.push(["points", number(score, Number.isInteger(score) ? 0 : 1)]);
  if (zones!.length) found.push(["is in", zones!.join(", ")]);
  return found;
}

type Shared = { orders: Orders; held: Held };

function Slider({
  of: [name, label, high, text, title],
  actual = 0,
  order,
  held,
}: Shared & { of: Knob; actual?: number; order: Order }) {
  const value = held.shown(name, actual),
    id = `knob-${name}`;
  return (
    // An output is something a label can be for, too: without its name the label would be the output's.
    <label class="slider" for={id} title={title}>
      {label}
      <output>{text(value)}</output>
      <input
        {...{ id, type: "range", min: 0, max: high, value, step: high > 100 ? 5 : high > 1 ? 0.1 : 0.01 }}
        dir={name === "ambient" ? "rtl" : undefined} // counted as light sensors do, low for bright: bright is at the right
        aria-valuetext={text(value)}
        onInput={({ currentTarget: { valueAsNumber: to } }) => held.ask(name, to, { ...order, [name]: to } as Order)}
      />
    </label>
  );
}

function Group({ title, children }: { title: string; children: ComponentChildren }) {
  const others = unfolded.value.filter((each) => each !== title),
    toggle = (isOpen: boolean) => (unfolded.value = isOpen ? [...others, title] : others);
  return (
    <details open={unfolded.value.includes(title)} onToggle={({ currentTarget: { open } }) => toggle(open)}>
      <summary>{title}</summary>
      {children}
    </details>
  );
}

function Sensors({ proximity }: { proximity?: number[] }) {
  return (
    <Group title="Infrared sensors">
      <p class="hint">What they read now, without noise</p>
      <div class="bars" role="group" aria-label="infrared sensors, counts">
        {SIDES.flatMap((name, k) => [
          <span>{`IR${k} ${name}`}</span>,
          <meter aria-hidden="true" max={DARK} value={proximity?.[k] ?? 0} />,
          <span>{proximity?.[k] ?? "–"}</span>,
        ])}
      </div>
    </Group>
  );
}

type OfRobot = Shared & { readings: Readings | undefined; robot: number };

function Link({ orders, held, readings: { link, base } = {} as Readings, robot }: OfRobot) {
  const isCut = held.shown("cut", link?.cut ?? false),
    added = FAULTS.filter(([key]) => base?.[key]).map(
      ([key, label, , text]) => `${label.toLowerCase()} ${text(base![key])}`,
    );
  const notes = [
    added.length && `The robot's URL adds: ${added.join(", ")}.`,
    link?.script.length && `The fault script does now: ${link.script.join(", ")}.`,
    link && !link.connected && !link.cut && "No program has opened this robot yet.",
  ];
  const undo = async () => {
    await orders.send({ do: "set_faults", robot, loss: 0, latency: 0, jitter: 0 });
    if (isCut) await orders.send({ do: "mend", robot });
  };
  const cut = (isOn: boolean) => held.ask("cut", isOn, { do: isOn ? "cut" : "mend", robot });
  return (
    <Group title="Link of this robot">
      <Check id="world-link" role="switch" isOn={isCut} act={cut}>
        Cut the link
      </Check>
      {FAULTS.map((fault) => (
        <Slider
          key={fault[0]}
          {...{ orders, held, of: fault, order: { do: "set_faults", robot } }}
          actual={link?.[fault[0]]}
        />
      ))}
      <p class="hint">{notes.filter(Boolean).join(" ")}</p>
      <Button act={undo}>Undo all faults</Button>
    </Group>
  );
}

/** What can be broken in the robot itself, and how. */
function Parts({ orders, readings, robot }: OfRobot) {
  const chosen = useSignal("proximity 0"),
    how = useSignal("factor 0"),
    amount = useSignal("300"),
    [of = "", number] = chosen.value.split(" "),
    unit = PARTS.find(([name]) => name === of)?.[3] ?? "";
  const kinds: [string, string][] = unit
    ? [
        ["factor 0", "dead"],
        ["stuck", "stuck at"],
        ["shift", "shifted by"],
        ["noise", "noisy by"],
        ["factor 0.5", "weak"],
      ]
    : of === "clock"
      ? [
          ["factor 0.8", "slow"],
          ["factor 1.25", "fast"],
        ]
      : [
          ["factor 0", "loose"],
          ["factor 0.5", "slow"],
        ];
  if (!kinds.some(([kind]) => kind === how.value)) how.value = kinds[0]![0];
  const [key = "", fixed] = how.value.split(" ");
  const order = (more: object) =>
    orders.send({ do: "set_defect", robot, of, number: number ? Number(number) : null, ...more } as Order);
  const broken = readings?.link.broken ?? [];
  return (
    <Group title="Parts of this robot">
      <div class="row">
        <Select
          class="fill"
          aria-label="part"
          value={chosen}
          choices={PART_CHOICES}
          choose={(to) => (chosen.value = to)}
        />
        <Select aria-label="what is wrong with it" value={how} choices={kinds} choose={(to) => (how.value = to)} />
      </div>
      {fixed === undefined && (
        <label class="row">
          <span class="fill">{unit}</span>
          <input
            class="fill"
            type="number"
            step="any"
            value={amount}
            onInput={(e) => (amount.value = e.currentTarget.value)}
          />
        </label>
      )}
      <div class="row">
        <Button act={() => order({ [key]: Number(fixed ?? amount.value) })}>Break</Button>
        <Button act={() => order({})}>Mend</Button>
        <Button act={() => orders.send({ do: "mend_parts", robot })}>Mend all</Button>
      </div>
      <p class="hint">{broken.length ? `Broken now: ${broken.join("; ")}.` : "All its parts work."}</p>
    </Group>
  );
}

/** What a hand can do to the robot itself. */
function Hands({ orders, held, readings, robot }: OfRobot) {
  const key = useSignal("0"),
    turn = (position: number) => held.ask("selector", position, { do: "turn_selector", robot, position }),
    hold = (pressed: boolean) => held.ask("button", pressed, { do: "press_button", robot, pressed }),
    press = () => orders.send({ do: "press_remote", robot, key: Number(key.value) });
  const selector = held.shown("selector", readings?.selector ?? 0);
  return (
    <Group title="Robot's controls">
      <label class="row">
        <span class="fill">Selector</span>
        <Select id="world-selector" value={selector} choices={POSITIONS} choose={(value) => turn(Number(value))} />
      </label>
      <div class="row">
        <span class="fill">Remote control</span>
        <Select
          aria-label="key of the remote control"
          value={key}
          choices={REMOTE.map((what, number) => [number, `${number} ${what}`])}
          choose={(chosen) => (key.value = chosen)}
        />
        <Button act={press}>Press</Button>
      </div>
      {typeof readings?.button === "boolean" && (
        <Check id="world-button" role="switch" isOn={held.shown("button", readings.button)} act={hold}>
          User button held down
        </Check>
      )}
    </Group>
  );
}
