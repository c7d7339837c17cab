// Stand-in until the world's author delivers.
import { signal } from "@preact/signals";
import type { Change, NewScene, Readings, Scene } from "../messages";

export class World {
  readonly scene = signal<Scene | null>(null);
  readonly readings = signal<Readings | null>(null);
  take(message: NewScene | Change | Readings) {
    if (message.type === "scene") this.scene.value = message.scene;
  }
  takeFrame(_: ArrayBuffer) {}
}
