import type { World as Model } from "./scene";

export function World({ world }: { world: Model }) {
  return <p class="hint">{world.scene.value?.world}</p>;
}
