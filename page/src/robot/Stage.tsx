// The largest thing on the page of a robot: its world if it is a virtual one, otherwise the path that it has driven.
import type { Robot } from "../store";
import { worldOf } from "../store";
import { World } from "../world/World";
import { Path } from "./Path";
import { Playback } from "./Playback";

export function Stage({ robot }: { robot: Robot }) {
  const world = worldOf();
  return (
    <>
      {world.scene.value ? <World world={world} /> : <Path robot={robot} />}
      {robot.tick.value?.playback && <Playback robot={robot} />}
    </>
  );
}
