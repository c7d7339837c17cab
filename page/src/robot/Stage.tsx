// The largest thing on the page of a robot: its world if it is a virtual one, otherwise the path that it has driven.
import { listed, type Robot } from "../store";
import { useWorld } from "../world/live";
import { World } from "../world/World";
import { Path } from "./Path";
import { Playback } from "./Playback";

export function Stage({ robot }: { robot: Robot }) {
  const world = useWorld(robot.key),
    { world: of = "", index = null } = listed.value.find(({ key }) => key === robot.key) ?? {};
  return (
    <>
      {world.scene.value ? <World world={world} of={of} own={index} /> : <Path robot={robot} />}
      {robot.tick.value?.playback && <Playback robot={robot} />}
    </>
  );
}
