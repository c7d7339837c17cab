// The start page: one first step, a virtual robot or one's own. The other worlds stand below it.
import { effect, signal, useSignal } from "@preact/signals";
import { Bluetooth, Cable, Cpu, Play, RefreshCw, Wifi, X, type IconNode } from "lucide";
import { useEffect } from "preact/hooks";
import { Button } from "../look/Button";
import { title } from "../look/text";
import { isDark } from "../look/theme";
import type { Found, WorldInfo } from "../messages";
import { address, go } from "../route";
import { ask, hello, listed, robotOf } from "../store";
import "./Start.css";

const FIRST = "arena"; // the world to begin with
const RECENT = 2; // robots that were used before, in view
const CONNECTING = 15000; // ms that a demo waits for its robot
const EXAMPLES = [
  ["serial:///dev/rfcomm0", "Bluetooth or a cable, on Linux"],
  ["serial://COM4", "Bluetooth or a cable, on Windows"],
  ["tcp://192.168.1.20:1000", "a robot in the network"],
  ["sim://crowd?robots=20", "twenty virtual robots"],
];
const PAIRING = [
  "Switch the robot on.",
  "Open the Bluetooth settings of this computer and pair e-puck_NNNN. The PIN is the number NNNN, also on the robot.",
  "On Linux, bind it to a port: sudo rfcomm bind 0 and the address of the robot, then 1 (an e-puck2: 2).",
  "Look again. If it does not answer, connect it: the page then says why, and where its selector must stand.",
];
const ICONS: Record<Found["kind"], IconNode> = { bluetooth: Bluetooth, serial: Cable, simulation: Cpu, wifi: Wifi };

/** Wait until something is so, but not for ever. */
const until = (isSo: () => boolean) =>
  new Promise<void>((resolve) => {
    const end = effect(() => {
      if (isSo()) resolve();
    });
    setTimeout(() => (end(), resolve()), CONNECTING);
  });

/** Take the robots of a URL into the panel and show them; return their keys. */
async function open(url: string) {
  const keys = await ask("add", { url });
  if (!keys) return [];
  await until(() => listed.value.some(({ key }) => key === keys[0]));
  go(keys.length > 1 ? "#/all" : address(keys[0]));
  return keys;
}

/** Open a world and start a behaviour in it as soon as its robot is connected. */
async function play(world: string, name: string) {
  const [key] = await open(`sim://${world}`);
  if (!key) return;
  await until(() => robotOf(key).tick.value?.phase === "connected");
  await ask("behave", { robots: [key], name });
}

function Choice({ url, text = "", icon }: { url: string; text?: string; icon?: IconNode }) {
  return (
    <Button class="choice fill" icon={icon} act={() => open(url)}>
      <b>{url}</b>
      {text && <span class="hint">{text}</span>}
    </Button>
  );
}

const found = signal<Found[] | null>(null); // kept while the page is open: looking takes seconds
const look = async () => {
  found.value = null;
  found.value = (await ask("find", {})) ?? [];
};

function FoundRobots() {
  const there = found.value?.filter(({ firmware }) => firmware) ?? [],
    silent = found.value?.filter(({ firmware }) => !firmware) ?? [];
  if (!found.value) return <p class="hint">Looking for robots …</p>;
  return (
    <>
      {there.map(({ url, kind, description, firmware }) => (
        <Choice key={url} url={url} icon={ICONS[kind]} text={[description, firmware].filter(Boolean).join(", ")} />
      ))}
      {!there.length && <p>No robot answered. Is it switched on and paired?</p>}
      {!there.length && (
        <details>
          <summary>How do I pair it?</summary>
          <ol>
            {PAIRING.map((text) => (
              <li key={text}>{text}</li>
            ))}
          </ol>
        </details>
      )}
      {silent.length > 0 && (
        <details>
          <summary>{silent.length} more that did not answer</summary>
          {silent.map(({ url, kind, reason }) => (
            <Choice key={url} url={url} icon={ICONS[kind]} text={reason} />
          ))}
        </details>
      )}
    </>
  );
}

const recents = signal<string[]>([]);
const isVirtual = (url: string) => url.startsWith("sim:");

/** The robots of one kind that were used before, the newest first. */
function UsedBefore({ virtual }: { virtual: boolean }) {
  const urls = recents.value.filter((url) => isVirtual(url) === virtual);
  const row = (url: string) => (
    <div class="row" key={url}>
      <Choice url={url} />
      <Button
        weight="quiet"
        icon={X}
        label={`forget ${url}`}
        act={async () => (recents.value = (await ask("forget", { url })) ?? recents.value)}
      />
    </div>
  );
  if (!urls.length) return null;
  return (
    <div class="used stack">
      <h3>Used before</h3>
      {urls.slice(0, RECENT).map(row)}
      {urls.length > RECENT && (
        <details>
          <summary>{urls.length - RECENT} more</summary>
          {urls.slice(RECENT).map(row)}
        </details>
      )}
    </div>
  );
}

function ByAddress() {
  const url = useSignal("");
  return (
    <details>
      <summary>Connect by its address</summary>
      <form
        class="row"
        onSubmit={(event) => {
          event.preventDefault();
          open(url.value.trim());
        }}
      >
        <input
          class="fill"
          type="text"
          aria-label="URL of the robot"
          required
          maxLength={500}
          autocomplete="off"
          spellcheck={false}
          placeholder={EXAMPLES[0][0]}
          value={url}
          onInput={({ currentTarget }) => (url.value = currentTarget.value)}
        />
        <button class="plain">Connect</button>
      </form>
      <p class="hint">Press an example to put it into the field, then change it:</p>
      <ul>
        {EXAMPLES.map(([example, text]) => (
          <li key={example} class="row wrap">
            <Button weight="quiet" act={() => (url.value = example)}>
              <code>{example}</code>
            </Button>
            <span class="hint">{text}</span>
          </li>
        ))}
      </ul>
    </details>
  );
}

const picture = (world: string) => `/worlds/${world}.png${isDark() ? "?dark" : ""}`;

function WorldCard({ name, about, robots, firmware }: WorldInfo) {
  const demos = hello.value!.behaviours.filter(({ elsewhere, world }) => !elsewhere && world.split("?")[0] === name);
  return (
    <article class="card stack" aria-label={name}>
      <img src={picture(name)} alt={`${name} from above`} loading="lazy" />
      <div class="row">
        <h3 class="fill">{title(name)}</h3>
        <span class="hint">{[robots > 1 && `${robots} robots`, firmware].filter(Boolean).join(", ")}</span>
      </div>
      <p class="fill small">{about}</p>
      <div class="row wrap">
        <Button act={() => open(`sim://${name}`)} label={`open ${name}`}>
          Open
        </Button>
        {demos.slice(0, 2).map((each) => (
          <Button weight="quiet" icon={Play} key={each.name} title={each.summary} act={() => play(name, each.name)}>
            {title(each.name)}
          </Button>
        ))}
      </div>
    </article>
  );
}

export function Start() {
  useEffect(() => {
    look();
    ask("recents", {}).then((told) => (recents.value = told ?? []));
  }, []);
  return (
    <div class="start stack">
      <h1>Which robot do you want to drive?</h1>
      <div class="first columns">
        <section class="card stack virtual" aria-label="a virtual robot">
          <img src={picture(FIRST)} alt="" />
          <h2>A virtual robot</h2>
          <p>It drives in a room on this computer and has all sensors of a real one. Nothing can break.</p>
          <Button weight="primary" act={() => open(`sim://${FIRST}`)}>
            Drive a virtual robot
          </Button>
          <UsedBefore virtual />
        </section>
        <section class="card stack" aria-label="robots of this computer">
          <div class="row">
            <h2 class="fill">Your own robot</h2>
            <Button weight="quiet" icon={RefreshCw} act={look}>
              Look again
            </Button>
          </div>
          <FoundRobots />
          <UsedBefore virtual={false} />
          <ByAddress />
        </section>
      </div>
      <section class="stack" aria-label="virtual worlds">
        <h2>More worlds for a virtual robot</h2>
        <div class="worlds columns">
          {hello.value!.worlds.map((world) => (
            <WorldCard key={world.name} {...world} />
          ))}
        </div>
      </section>
    </div>
  );
}
