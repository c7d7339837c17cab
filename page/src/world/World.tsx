// A virtual world, live: its picture, the tools over it, and beside it what is known of what is selected.
import { signal, useSignal } from "@preact/signals";
import * as icons from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Select } from "../look/fields";
import { Icon } from "../look/Icon";
import { keep } from "../look/keep";
import { arrowsMove } from "../look/keys";
import { address, go } from "../route";
import { ask, can, listed, subscribe } from "../store";
import { Details } from "./Details";
import { Hand } from "./Hand";
import { hasRays } from "./live";
import { Orders } from "./orders";
import { MODES, type Mode, type World as Model } from "./scene";
import type { Stage } from "./Stage";
import { Past, TimeLine } from "./TimeLine";
import "./world.css";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 10];
const STEP = 0.1; // s
/** What the tools do, where their names do not say it. */
const HINTS: Record<string, string> = {
  Follow: "Keep the selected robot in the middle",
  Rays: "What the infrared sensors see",
  Trails: "Where the robots have been",
  "Pause world": "It stands still, and the robots' firmware with it. Programs outside get no answers meanwhile.",
  Step: `Go on by ${STEP} s; only while paused`,
  Delete: "Take the selected box or wall away",
  "Save …": "Save this world as a file",
};
/** What stands below the icons where there is room: a word for each. */
const WORDS: Record<string, string> = {
  "from above": "Map",
  "in three dimensions": "3-D",
  "through the robot's camera": "Eye",
  "Pause world": "Pause",
  "Continue world": "Go on",
  "Add a box": "Add box",
  "Add a wall": "Add wall",
  "Save …": "Save",
};
const wordOf = (label: string) => ({ "data-word": WORDS[label] ?? label });
const KEYS =
  "N P select, arrows move, [ ] turn, + − 0 zoom, V changes the camera, B box, M wall, Delete deletes, Escape selects nothing";
const CAMERAS: Record<Mode, [label: string, icon: icons.IconNode]> = {
  above: ["from above", icons.Map],
  orbit: ["in three dimensions", icons.Rotate3d],
  eye: ["through the robot's camera", icons.Eye],
};

// They outlive a page of a robot.
const hasDetails = signal(false);
const mode = signal<Mode>("orbit");

/** A checkbox that shows an icon, or a radio button of a group. */
const toggle = (icon: icons.IconNode, label: string, isOn: boolean, act: (isOn: boolean) => void, of?: string) => (
  <label key={label} class="button icon toggle" title={HINTS[label] ?? label} {...wordOf(label)}>
    <input
      class="over"
      {...{ type: of ? "radio" : "checkbox", name: of, "aria-label": label, checked: isOn }}
      onChange={({ currentTarget }) => act(currentTarget.checked)}
    />
    <Icon of={icon} />
  </label>
);

const tool = (icon: icons.IconNode, label: string, act: () => unknown, disabled = false) => (
  <Button
    key={label}
    weight="quiet"
    title={HINTS[label] ?? label}
    {...{ icon, label, act, disabled }}
    {...wordOf(label)}
  />
);

/** Draw a world on a canvas; what does that is loaded with the first one. */
export const stageOf = async (canvas: HTMLCanvasElement, world: Model) =>
  (await import("./View")).stageOf(canvas, world);

type Props = { world: Model; of: string; own?: number | null; isOfProgram?: boolean };

/** A world: *of* is its key, *own* the robot that the place is about, which is selected at first. */
export function World({ world, of, own = null, isOfProgram = false }: Props) {
  const canvas = useRef<HTMLCanvasElement>(null),
    stage = useSignal<Stage | null>(null),
    hand = useSignal<Hand | null>(null),
    orders = useRef<Orders>(null);
  orders.current ??= new Orders(
    world,
    isOfProgram ? "The next run begins without it: a world begins as its file says." : "",
  );
  const openRobot = (index: number) => {
    const found = listed.value.find((each) => each.world === of && each.index === index);
    if (found) go(address(found.key));
  };
  useEffect(() => {
    const element = canvas.current!;
    stageOf(element, world).then((made) => {
      if (!made) return;
      if (!made.isFlat) made.mode.value = mode.value;
      stage.value = Object.assign(element, { stage: made }).stage; // for tests, and under the bonnet
      hand.value = new Hand(made, orders.current!, openRobot);
    });
    return () => {
      stage.value?.close();
      hand.value?.close();
    };
  }, [world]);
  useEffect(() => {
    world.own = own;
    world.select(own === null ? null : world.thing("robot", own));
  }, [world.scene.value, own]);
  const selected = world.selected.value,
    watched = selected?.kind === "robot" ? selected.index : null;
  useEffect(() => {
    if (watched === null) return;
    if (stage.value && stage.value.followed.value !== null) stage.value.follow(watched);
    return subscribe({ what: "readings", of: String(watched), rate: 8 });
  }, [watched]);
  const isFocused = useSignal(false),
    isOwn = watched !== null && watched === own,
    moved = isFocused.value && !isOwn ? (selected?.name ?? "the view") : "";
  // Tell the pad what the arrow keys move while the world has the focus; nothing is the robot of this page.
  useEffect(() => void (arrowsMove.value = moved), [moved]);
  return (
    <section class="world over" aria-label={`world ${world.scene.value?.world ?? ""}`}>
      <Tools world={world} stage={stage.value} orders={orders.current} />
      <div class="world-view" data-past={world.past.value !== null}>
        <canvas
          class="over"
          ref={canvas}
          tabIndex={0}
          role="application"
          aria-label={`world: ${KEYS}`}
          onFocus={() => (isFocused.value = true)}
          onBlur={() => (isFocused.value = false)}
        />
        <div class="world-zoom">
          <Button weight="quiet" icon={icons.Plus} label="zoom in" act={() => stage.value?.zoomBy(1.4)} />
          <Button weight="quiet" icon={icons.Minus} label="zoom out" act={() => stage.value?.zoomBy(0.7)} />
          <Button weight="quiet" icon={icons.Maximize} label="Fit" act={() => stage.value?.showAll()} />
        </div>
        <Past world={world} orders={orders.current} isOfProgram={isOfProgram} />
        <p class="world-said" role="status">
          {orders.current.said.value}
        </p>
        {hasDetails.value && (
          <aside class="card stack world-detail" id="world-detail" aria-label="what is selected">
            <Button weight="quiet" icon={icons.X} label="close the details" act={() => (hasDetails.value = false)} />
            <Details key={selected?.key} world={world} orders={orders.current} turn={(by) => hand.value?.turn(by)} />
            {!selected && can().edit && <p class="hint">{`Keys: ${KEYS}`}</p>}
          </aside>
        )}
      </div>
      <TimeLine world={world} isOfProgram={isOfProgram} />
    </section>
  );
}

function Tools({ world, stage, orders }: { world: Model; stage: Stage | null; orders: Orders }) {
  const { edit, speed, save } = can(),
    { paused } = world.clock.value,
    { mayEdit } = orders,
    follows = (stage?.followed.value ?? null) !== null,
    canDelete = mayEdit && ["box", "wall"].includes(world.selected.value?.kind ?? ""),
    add = (kind: "box" | "wall") => () => stage && orders.add(kind, stage.middle);
  return (
    <div class="world-tools row wrap scrolls" inert={!world.isLive.value}>
      {stage && !stage.isFlat && (
        <div class="row group" role="radiogroup" aria-label="camera">
          {MODES.map((each) => {
            const [label, icon] = CAMERAS[each],
              turn = () => (stage.mode.value = mode.value = each);
            return toggle(icon, label, stage.mode.value === each, turn, "camera");
          })}
        </div>
      )}
      {stage && (
        <div class="row group">
          {toggle(icons.LocateFixed, "Follow", follows, (isOn) => stage.follow(isOn ? stage.chosen : null))}
          {toggle(icons.Radar, "Rays", hasRays.value, (isOn) => (hasRays.value = isOn))}
          {toggle(icons.Route, "Trails", stage.hasTrails.value, (isOn) => (stage.hasTrails.value = isOn))}
        </div>
      )}
      {speed && (
        <div class="row group">
          {paused
            ? tool(icons.Play, "Continue world", () => orders.send({ do: "resume" }))
            : tool(icons.Pause, "Pause world", () => orders.send({ do: "pause" }))}
          {tool(icons.StepForward, "Step", () => orders.send({ do: "step", seconds: STEP }), !paused)}
          <Speed world={world} orders={orders} />
        </div>
      )}
      <span class="fill" />
      <div class="row group">
        {edit && tool(icons.PackagePlus, "Add a box", add("box"), !mayEdit)}
        {edit && tool(icons.BrickWall, "Add a wall", add("wall"), !mayEdit)}
        {edit && tool(icons.Trash2, "Delete", () => orders.remove(), !canDelete)}
        {save &&
          tool(icons.Save, "Save …", () =>
            keep(
              "Save this world",
              "Everything is saved where it stands now, robots too.",
              `${world.scene.value?.world}-2`,
              (name) => ask("save_world", { name }),
            ),
          )}
        <Button
          weight="quiet"
          icon={icons.PanelRight}
          label="Details"
          data-word="Details"
          aria-expanded={hasDetails.value}
          aria-controls="world-detail"
          act={() => (hasDetails.value = !hasDetails.value)}
        />
      </div>
    </div>
  );
}

function Speed({ world, orders }: { world: Model; orders: Orders }) {
  const { speed, fixed } = world.clock.value,
    speeds = SPEEDS.includes(speed) ? SPEEDS : [...SPEEDS, speed];
  return (
    <Select
      aria-label="speed of the world"
      value={speed}
      disabled={fixed !== ""}
      title={fixed ? `The speed cannot be changed: ${fixed}` : "Programs keep their own time"}
      choices={speeds.map((each) => [each, `× ${each}`])}
      choose={(chosen) => orders.send({ do: "set_speed", speed: Number(chosen) })}
    />
  );
}
