// The last minute of a world: a time line that shows it as it was, and a button that lets it go on from there.
import { History } from "lucide";
import { Button } from "../look/Button";
import { Icon } from "../look/Icon";
import { stops } from "../stop";
import { can, hello } from "../store";
import type { Orders } from "./orders";
import type { World } from "./scene";

const STEP = 0.1; // s
const HINT = "All robots of this page are stopped, and behaviours end; then robots and things are put back";
const WENT_BACK =
  "Robots and things are back, and your robots stand. Not put back: wheel counters, LEDs, batteries, and what programs remember.";

/** Where *isOfProgram*, the time is that of a program: no hand pauses it, and it does not go back. */
type Props = { world: World; orders: Orders; isOfProgram: boolean };

const agoOf = ({ past, span }: World) => (past.value === null ? 0 : Math.max(STEP, span.value[1] - past.value));

/** The time of the world, and why it goes otherwise than a person expects. */
function timeOf({ frame, clock, ratio, isLive }: World, isOfProgram: boolean) {
  const { paused, speed } = clock.value,
    isSlow = ratio !== null && !paused && ratio < 0.85 * speed,
    note = isOfProgram ? "" : paused ? ", paused" : isSlow ? `, slower: × ${ratio.toFixed(1)}` : "";
  return isLive.value ? `${(frame.value?.time ?? 0).toFixed(1)} s${note}` : "disconnected";
}

export function TimeLine({ world, isOfProgram }: Omit<Props, "orders">) {
  const [first, last] = world.span.value,
    ago = agoOf(world),
    steps = Math.floor((last - first) / STEP);
  return (
    <label class="world-time row small">
      <Icon of={History} />
      <input
        {...{ type: "range", min: -steps * STEP, max: 0, step: STEP, value: -ago, disabled: !steps }}
        aria-label="time line of the last minute"
        aria-valuetext={ago ? `${ago.toFixed(1)} s ago` : "now"}
        onInput={({ currentTarget: { valueAsNumber: at } }) => world.lookAt(at < -STEP / 2 ? last + at : null)}
      />
      <output class="time">{ago ? `−${ago.toFixed(1)} s` : timeOf(world, isOfProgram)}</output>
    </label>
  );
}

/** Says over the picture that it shows the past, and leads out of it. */
export function Past({ world, orders, isOfProgram }: Props) {
  const time = world.past.value;
  if (time === null) return null;
  const goBack = async () => {
    stops.value++; // a stick that is held would drive on from there
    if (!(await orders.send({ do: "go_back", time }))?.ok) return;
    world.lookAt(null);
    orders.say(WENT_BACK);
  };
  return (
    <div class="world-past card">
      <strong>The world {agoOf(world).toFixed(1)} s ago</strong>
      {can().edit && !isOfProgram && !hello.value?.study && (
        <Button weight="primary" title={HINT} disabled={!world.isLive.value} act={goBack} children="Go on from here" />
      )}
      <Button act={() => world.lookAt(null)}>Back to now</Button>
    </div>
  );
}
