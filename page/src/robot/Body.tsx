// The robot from above, its front upwards: what its infrared sensors see, as light, and its LEDs, which can be clicked.
import { useSignal } from "@preact/signals";
import { number } from "../look/text";
import { hello, type Robot } from "../store";
import "./Body.css";

const RADIUS = 60, // of the robot in the drawing
  REACH = 46, // of its infrared light
  FAR = 0.06; // m: the server tells no greater distance

type Command = [name: string, ...values: number[]];

/** A point so far from the middle, in a direction counted from straight ahead, positive to the left. */
const at = (angle: number, radius: number) => [-radius * Math.sin(angle), -radius * Math.cos(angle)] as const;

function wedge(angle: number, from: number, to: number, half: number) {
  const corner = (side: number, radius: number) =>
    at(angle + side * half, radius)
      .map((each) => each.toFixed(1))
      .join();
  return `M${corner(-1, from)}L${corner(-1, to)}A${to},${to} 0 0 0 ${corner(1, to)}L${corner(1, from)}A${from},${from} 0 0 1 ${corner(-1, from)}Z`;
}

function Sensor({ robot, sensor, angle }: { robot: Robot; sensor: number; angle: number }) {
  const { readings, distances } = robot.tick.value!,
    name = robot.scheme.value?.instruments.find((each) => each.name === "proximity")?.labels[sensor],
    counts = readings.proximity?.values?.[sensor] as number | null | undefined,
    metres = distances[sensor] ?? null,
    share = Math.min(1, (metres ?? FAR) / FAR),
    end = RADIUS + 5 + share * (REACH - 6),
    cm = metres === null ? "" : `${number(100 * metres, 1)} cm`,
    isKnown = typeof counts === "number",
    about = cm ? `about ${cm}` : `nothing within ${100 * FAR} cm`,
    [x, y] = at(angle, RADIUS + REACH + 17);
  return (
    <g role="img" class={`sensor ${readings.proximity?.stale ? "stale" : ""}`}>
      <title>{`IR${sensor}, ${name}: ${isKnown ? `${counts} counts, ${about}` : "unknown"}`}</title>
      <path
        {...(isKnown ? { fill: "url(#infrared)" } : { stroke: "var(--line)" })}
        d={wedge(angle, RADIUS + 2, end, 0.16)}
      />
      {cm && <path fill={`var(--${share < 0.34 ? "bad" : "wall"})`} d={wedge(angle, end, end + 7 - 3 * share, 0.16)} />}
      <text x={x} y={y - 11}>{`IR${sensor}`}</text>
      <text x={x} y={y} class="count">
        {number(counts)}
      </text>
      <text x={x} y={y + 11}>
        {isKnown && (cm || "free")}
      </text>
    </g>
  );
}

type LampProps = { robot: Robot; name: string; kind: string; command: Command; isOn: boolean; colour?: number[] };
type Spot = { x: number; y: number; size: number; hasNumber?: boolean };

/** An LED. It says that it was clicked until the robot has answered. */
function Lamp({ robot, name, kind, command, isOn, colour, x, y, size, hasNumber }: LampProps & Spot) {
  const isBusy = useSignal(false),
    [what, ...values] = command;
  const flip = async () => {
    if (isBusy.value) return;
    isBusy.value = true;
    await robot.ask("command", { name: what, arguments: [...values, Number(!isOn)] });
    isBusy.value = false;
  };
  // Ten percent are bright to the eye already.
  const most = Math.max(1, ...(colour ?? [])),
    lit = colour?.map((share) => Math.round((1.5 * (100 + most / 1.43) * share) / most));
  return (
    <g
      role="switch"
      tabindex={0} // in SVG, names of attributes have one case
      aria-label={name}
      aria-checked={isOn}
      aria-busy={isBusy.value || undefined}
      class={`lamp ${kind}`}
      style={{ "--lit": lit ? `rgb(${lit})` : `var(--lit-${kind})` }}
      transform={`translate(${x.toFixed(1)} ${y.toFixed(1)})`}
      onClick={flip}
      onKeyDown={({ key }) => key === "Enter" && flip() /* Space stops the robot */}
    >
      <title>{name}</title>
      <circle r={Math.max(size + 3, 12)} class="touch" />
      <circle r={1.8 * size} class="glow" />
      <circle r={size} class="glass" />
      {hasNumber && <text>{/\d$/.exec(name)}</text>}
    </g>
  );
}

/** The drawing; without its sensors the robot is larger. */
export function Body({ robot, sensors = false }: { robot: Robot; sensors?: boolean }) {
  const { lamps, drive, readings } = robot.tick.value!,
    { fastest = 1, instruments = [] } = robot.scheme.value ?? {},
    ring = hello.value?.ring ?? { sensors: [], leds: [] },
    light = readings.ambient_light,
    darkest = instruments.find(({ name }) => name === "ambient_light")?.high ?? 4095;
  return (
    <svg
      class="robot"
      viewBox={sensors ? "-140 -134 280 258" : "-72 -70 144 140"}
      role="group"
      aria-label="the robot from above, its front upwards"
    >
      <radialGradient id="infrared" gradientUnits="userSpaceOnUse" cx="0" cy="0" r={RADIUS + REACH}>
        <stop offset="0.5" stop-color="var(--ray)" stop-opacity="0.75" />
        <stop offset="1" stop-color="var(--ray)" stop-opacity="0.1" />
      </radialGradient>
      {sensors && ring.sensors.map((angle, k) => <Sensor key={k} robot={robot} sensor={k} angle={angle} />)}
      <circle r={RADIUS} fill="var(--shell)" />
      {[drive.left, drive.right].map((speed, wheel) => {
        const long = (38 * (speed ?? 0)) / fastest,
          head = 5 * Math.sign(long);
        return (
          <g key={wheel} transform={`translate(${wheel ? 48 : -48} 0)`}>
            <rect x={-5} y={-21} width={10} height={42} rx={3} fill="var(--tyre)" />
            <path class="speed" d={Math.abs(long) < 1 ? "" : `M0,0v${-long}m-4,${head}l4,${-head}l4,${head}`} />
          </g>
        );
      })}
      <circle r={41} fill="var(--board)" />
      {ring.sensors.map((angle, k) => {
        const counts = light?.values?.[k],
          isKnown = typeof counts === "number"; // the fewer counts, the brighter
        return (
          <path
            key={k}
            fill="var(--lamplight)"
            d={wedge(angle, 33, 39, 0.19)}
            fill-opacity={isKnown && !light.stale ? 1 - 0.9 * Math.min(1, counts / darkest) : 0}
          >
            <title>{`light ${k}: ${isKnown ? `${counts} counts, higher is darker` : "unknown"}`}</title>
          </path>
        );
      })}
      <path d="M0,-30L9,-12L0,-17L-9,-12Z" fill="var(--on-dark)" />
      {ring.leds.map((angle, led) => {
        const [x, y] = at(angle, 50),
          colour = led % 2 ? lamps.rgb?.[(led - 1) / 2] : undefined,
          lamp = { name: `LED ${led}`, kind: "ring", isOn: Boolean(lamps.ring[led]), colour, x, y, size: 8 };
        // Beside the numbers of the sensors, those of the LEDs would be read as theirs.
        return <Lamp key={led} robot={robot} command={["set_led", led]} hasNumber={!sensors} {...lamp} />;
      })}
      <Lamp
        {...{ robot, name: "body light", kind: "body", isOn: Boolean(lamps.body), x: 0, y: 12, size: 18 }}
        command={["set_body_led"]}
      />
      <Lamp
        {...{ robot, name: "front LED", kind: "front", isOn: Boolean(lamps.front), x: 26, y: -57, size: 6 }}
        command={["set_front_led"]}
      />
    </svg>
  );
}
