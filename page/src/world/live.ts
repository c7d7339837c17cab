// Being told of a world.
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { subscribe, worldOf } from "../store";

const RATE = 25; // Hz: frames of a world that fills the place

/** Whether the rays of the infrared sensors are shown. It outlives a page of a robot. */
export const hasRays = signal(false);

/** The world of a robot by its key, or the one that the page shows; it is told while the component is there. */
export function useWorld(of: string) {
  const rays = hasRays.value;
  useEffect(() => {
    worldOf().open(of);
    return subscribe({ what: "world", of, rate: RATE, rays });
  }, [of, rays]);
  return worldOf();
}
