// The camera: the newest picture, upright, how it is taken, and a file of it.

import { age, button, make, pending, say, store } from "./dom.js";

/** @import { Remote } from "./dom.js" */
/** @import { Known, Picture, Tick } from "./hub.js" */

/** @type {[value: string, text: string][]} */
const MODES = [
  ["GREY", "grey"],
  ["COLOUR", "colour"],
];
/** @type {[value: string, text: string][]} */
const PACES = [
  ["", "off"],
  ["0.5", "2 per second"],
  ["1", "every second"],
  ["2", "every 2 s"],
  ["5", "every 5 s"],
];
const ZOOMS = ["20", "12", "8", "4", "2", "1"];
const SCALE = 8; // of a saved picture
const CAPTURE = 0.022,
  BYTE = 86.8e-6; // s from a request to the picture, and for a byte of it at 115,200 baud (wire-protocol.md, 5.13, 5.14)
const STOP_DELAY = 0.1; // s that a person does not notice

/** @param {string} label @param {HTMLElement} control */
const field = (label, control) => make("label", { className: "field" }, make("span", { textContent: label }), control);

/** @param {[value: string, text: string][]} options @param {(list: HTMLSelectElement) => unknown} act */
function choice(options, act) {
  const list = make("select", {}, ...options.map(([value, text]) => new Option(text, value)));
  list.onchange = () => pending(list, Promise.resolve(act(list)));
  return list;
}

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot */
  constructor(box, robot) {
    this.robot = robot;
    this.seen = ""; // the picture that is painted
    this.settings = ""; // those of the robot that are shown
    box.classList.add("camera");
    this.canvas = make("canvas", {
      width: 40,
      height: 40,
      role: "img",
      "aria-label": "picture of the robot's camera: none yet",
    });
    this.none = make("p", { className: "none", textContent: "no picture yet" });
    this.caption = make("p", { className: "ages" });
    const size = () => {
      const input = make("input", { type: "number", min: 1, max: 640, value: 40, required: true });
      input.onchange = () => pending(input, Promise.resolve(this.set()));
      return input;
    };
    this.widthInput = size();
    this.heightInput = size();
    this.zoomList = choice(
      ZOOMS.map((zoom) => [zoom, zoom === "1" ? "1, the closest" : zoom]),
      () => this.set(),
    );
    this.modeList = choice(MODES, () => this.set());
    this.liveList = choice(PACES, ({ value }) => robot.ask("live", { seconds: value ? Number(value) : null }));
    this.take = button("Take picture", () => robot.ask("picture"));
    this.save = button("Save PNG", () => this.store(), { disabled: true, title: "Save this picture" });
    this.slow = make("p", { className: "hint", role: "status" });
    this.fields = [
      field("Colour", this.modeList),
      field("Width", this.widthInput),
      field("Height", this.heightInput),
      field("Zoom", this.zoomList),
    ];
    box.replaceChildren(
      make("div", { className: "frame" }, this.canvas, this.none),
      make(
        "div",
        { className: "controls" },
        this.caption,
        this.slow,
        make(
          "div",
          { className: "take" },
          this.take,
          this.save,
          make(
            "details",
            {},
            make("summary", { textContent: "Settings" }),
            make("div", { className: "fields" }, field("Live", this.liveList), ...this.fields),
          ),
        ),
      ),
    );
  }

  set() {
    const { widthInput: width, heightInput: height } = this;
    if (!width.reportValidity() || !height.reportValidity()) return undefined;
    return this.robot.ask("set_camera", {
      width: width.valueAsNumber,
      height: height.valueAsNumber,
      zoom: Number(this.zoomList.value),
      mode: this.modeList.value,
    });
  }

  /** @param {Known} robot */
  show({ tick, scheme, pixels }) {
    const isOn = tick.phase === "connected";
    for (const option of this.zoomList.options)
      option.hidden = Boolean(scheme?.firmware.startsWith("epuck2")) && Number(option.value) > 8;
    for (const control of [this.take, this.widthInput, this.heightInput, this.zoomList, this.modeList, this.liveList])
      control.disabled = !isOn;
    for (const each of this.fields) each.hidden = isOn && !tick.camera; // over Wi-Fi pictures have one size
    if (tick.camera) this.follow(tick.camera);
    const live = tick.live === null ? "" : String(tick.live);
    if (this.liveList !== document.activeElement && this.liveList.value !== live) this.liveList.value = live;
    const { picture } = tick;
    this.none.hidden = Boolean(picture && pixels);
    this.canvas.hidden = !picture || !pixels;
    this.save.disabled = this.canvas.hidden;
    if (!picture || !pixels) {
      say(
        this.none,
        isOn ? "no picture yet" : tick.phase === "playing" ? "no picture recorded until now" : "not connected",
      );
      say(this.caption, "");
      return;
    }
    if (pixels !== this.seen) this.paint(picture, pixels);
    this.canvas.classList.toggle("stale", picture.stale);
    this.caption.classList.toggle("stale", picture.stale);
    say(
      this.caption,
      `${picture.width} × ${picture.height} pixels, ${picture.mode.toLowerCase()}, ${live ? "live, " : ""}${age(picture.age)} old`,
    );
  }

  /**
   * Show the settings of the robot, unless somebody is just choosing others.
   * @param {NonNullable<Tick["camera"]>} camera
   */
  follow(camera) {
    const news = JSON.stringify(camera);
    if (news === this.settings) return;
    this.settings = news;
    this.widthInput.value = String(camera.width);
    this.heightInput.value = String(camera.height);
    const zoom = String(camera.zoom);
    if (![...this.zoomList.options].some((option) => option.value === zoom)) this.zoomList.add(new Option(zoom));
    this.zoomList.value = zoom;
    this.modeList.value = camera.mode;
    const seconds = CAPTURE + camera.width * camera.height * (camera.mode === "GREY" ? 1 : 2) * BYTE;
    say(this.slow, seconds > STOP_DELAY ? `A picture takes ${seconds.toFixed(1)} s. A stop waits for it.` : "");
  }

  /** @param {Picture} picture @param {string} pixels */
  paint(picture, pixels) {
    this.seen = pixels;
    const raw = Uint8Array.from(atob(pixels), (letter) => letter.charCodeAt(0)),
      { width, height } = picture;
    const data = new ImageData(width, height),
      parts = picture.mode === "COLOUR" ? 3 : 1;
    for (let pixel = 0; pixel < width * height; pixel++) {
      for (let part = 0; part < 3; part++) data.data[4 * pixel + part] = raw[parts * pixel + (parts === 3 ? part : 0)];
      data.data[4 * pixel + 3] = 255;
    }
    [this.canvas.width, this.canvas.height] = [width, height];
    /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d")).putImageData(data, 0, 0);
    // As large as fits, each pixel a whole square: what the robot sees is coarse, and is to look so.
    this.canvas.style.aspectRatio = `${width} / ${height}`;
    this.canvas.setAttribute("aria-label", `picture of the robot's camera, ${width} by ${height} pixels`);
  }

  store() {
    const large = make("canvas", { width: this.canvas.width * SCALE, height: this.canvas.height * SCALE }),
      pen = /** @type {CanvasRenderingContext2D} */ (large.getContext("2d"));
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.canvas, 0, 0, large.width, large.height);
    large.toBlob((blob) => {
      if (blob) store(blob, `epuck-${new Date().toISOString().replace(/[:.]/g, "-")}.png`);
    });
  }
}
