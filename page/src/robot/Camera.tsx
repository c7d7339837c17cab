// The camera: the newest picture, upright, how it is taken, and a file of it.
import { useSignal } from "@preact/signals";
import { Camera as Shutter, Download, Settings } from "lucide";
import { useLayoutEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Select } from "../look/fields";
import { Popup } from "../look/Popup";
import { age, save } from "../look/text";
import type { CameraSettings, Picture } from "../messages";
import type { Robot } from "../store";
import "./Camera.css";

type Wish = Partial<CameraSettings> & { live?: number | null };
type Choices = [value: string | number | null, text: string][];

const PACES: Choices = [
  [null, "off"],
  [0.5, "2 per second"],
  [1, "every second"],
  [2, "every 2 s"],
  [5, "every 5 s"],
];
const MODES: Choices = [
  ["GREY", "grey"],
  ["COLOUR", "colour"],
];
const SCALE = 8; // of a saved picture
const STOP_DELAY = 0.1; // s that a person does not notice
const ZOOMS = [20, 12, 8, 4, 2, 1]; // where every factor works

/** Paint a picture, one pixel of the canvas for each. */
function paint(canvas: HTMLCanvasElement, { width, height, mode }: Picture, pixels: string) {
  const raw = Uint8Array.from(atob(pixels), (letter) => letter.charCodeAt(0)),
    image = new ImageData(width, height),
    parts = mode === "COLOUR" ? 3 : 1;
  for (let pixel = 0; pixel < width * height; pixel++) {
    const first = parts * pixel;
    image.data.set([raw[first], raw[first + (parts >> 1)], raw[first + parts - 1], 255], 4 * pixel);
  }
  [canvas.width, canvas.height] = [width, height];
  canvas.getContext("2d")!.putImageData(image, 0, 0);
}

function saveLarge(canvas: HTMLCanvasElement) {
  const large = document.createElement("canvas"),
    pen = large.getContext("2d")!;
  [large.width, large.height] = [canvas.width * SCALE, canvas.height * SCALE];
  pen.imageSmoothingEnabled = false;
  pen.drawImage(canvas, 0, 0, large.width, large.height);
  large.toBlob((blob) => blob && save(blob, `epuck-${new Date().toISOString().replace(/[:.]/g, "-")}.png`));
}

function Fields({ robot }: { robot: Robot }) {
  const wish = useSignal<Wish>({}), // what was asked for, until the robot has it
    { camera = null, live = null, phase } = robot.tick.value ?? {},
    shown: Wish = { ...camera, live, ...wish.value },
    isOff = phase !== "connected";
  const set = async (change: Wish) => {
    wish.value = change;
    const { width, height, zoom, mode } = { ...camera!, ...change };
    if ("live" in change) await robot.ask("live", { seconds: change.live ?? null });
    else await robot.ask("set_camera", { width, height, zoom, mode: mode === "COLOUR" ? mode : "GREY" });
    wish.value = {};
  };
  const list = (label: string, name: "live" | "mode" | "zoom", choices: Choices) => (
    <label class="field">
      {label}
      <Select
        value={String(shown[name])}
        disabled={isOff}
        choices={choices.map(([value, text]) => [String(value), text])}
        choose={(chosen) => set({ [name]: choices.find(([value]) => String(value) === chosen)?.[0] })}
      />
    </label>
  );
  const size = (label: string, name: "width" | "height") => (
    <label class="field">
      {label}
      <input
        type="number"
        min={1}
        max={640}
        required
        key={shown[name]} // what is being typed stays, until the robot has another
        defaultValue={shown[name]}
        disabled={isOff}
        onChange={({ currentTarget }) => currentTarget.reportValidity() && set({ [name]: currentTarget.valueAsNumber })}
      />
    </label>
  );
  const zooms = [...new Set([...(robot.scheme.value?.camera?.zooms ?? ZOOMS), camera?.zoom ?? 1])];
  return (
    <div class="settings columns">
      {list("Live", "live", PACES)}
      {camera && ( // over Wi-Fi pictures have one size
        <>
          {list("Colour", "mode", MODES)}
          {size("Width", "width")}
          {size("Height", "height")}
          {list(
            "Zoom",
            "zoom",
            zooms.map((zoom) => [zoom, zoom === 1 ? "1, the closest" : String(zoom)]),
          )}
        </>
      )}
    </div>
  );
}

export function Camera({ robot }: { robot: Robot }) {
  const canvas = useRef<HTMLCanvasElement>(null),
    pixels = robot.pixels.value,
    { phase, camera, live, picture: found } = robot.tick.value ?? {},
    picture = (pixels && found) || null,
    limits = robot.scheme.value?.camera,
    bytes = camera ? camera.width * camera.height * (camera.mode === "GREY" ? 1 : 2) : 0,
    pause = camera && limits ? limits.capture + bytes * limits.byte : 0,
    isWatched = phase === "playing" || phase === "watched", // it takes no orders from here
    isOff = phase !== "connected";
  useLayoutEffect(() => {
    if (picture && pixels) paint(canvas.current!, picture, pixels);
  }, [pixels]);
  const { width = 0, height = 0, mode = "", age: old = null, stale = false } = picture ?? {},
    about = picture ? `${width} × ${height}, ${mode.toLowerCase()}, ${live ? "live, " : ""}${age(old)} old` : "",
    none = isWatched ? "no picture until now" : isOff ? "not connected" : "no picture yet",
    label = `picture of the robot's camera${picture ? `, ${width} by ${height} pixels` : ": none yet"}`;
  return (
    <div class="frame">
      <canvas ref={canvas} hidden={!picture} class={`over ${stale ? "stale" : ""}`} role="img" aria-label={label} />
      <p class={picture ? "ages" : "none"}>{picture ? about : none}</p>
      {pause > STOP_DELAY && (
        <p class="slow" role="status">
          A picture takes {pause.toFixed(1)} s. A stop waits for it.
        </p>
      )}
      <div class="tools stack">
        {!isWatched && (
          <Button icon={Shutter} label="Take picture" disabled={isOff} act={() => robot.ask("picture", {})} />
        )}
        <Button icon={Download} label="Save PNG" disabled={!picture} act={() => saveLarge(canvas.current!)} />
        <span class="fill" />
        {!isWatched && (
          <Popup icon={Settings} label="settings of the camera">
            <Fields robot={robot} />
          </Popup>
        )}
      </div>
    </div>
  );
}
