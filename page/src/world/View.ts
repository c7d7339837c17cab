// The world in three dimensions. All views of a page share one renderer, which hands each its picture: a browser gives
// few of them. What is written over the picture has a canvas of its own, because copying pictures takes long.
import * as three from "three";
import { hello } from "../store";
import { epuck, LED_HEIGHT } from "./epuck";
import { FRAME } from "../messages";
import { Flat } from "./Flat";
import type { World } from "./scene";
import { Stage } from "./Stage";

const LEVELS = [
  // how well it is drawn: pixels for one of the canvas, and the side of the shadow map; the first is for what stands still
  [1, 2048],
  [1, 1024],
  [0.75, 512],
  [0.6, 0],
] as const;
const SLOW = 1 / 27; // s for a picture, beyond which it is drawn less well
const PATIENCE = 20; // pictures until that is judged
const STILL = 250; // ms without a change after which it is drawn as well as can be
const SHINING = 4; // lamps that light up what stands around them; more would take long
const DARK = 4095, // counts of a light sensor without any light, and in a room as it usually is
  ROOM = 3790;
const HALO = 0.034; // m across the shine of an LED
const PEN = 0.006; // m: how wide a pen's line is
// The colours of a robot: its body with its light off and on, its ring as it stands free or touches something, and LEDs.
const [CLEAR, GREEN, PALE, RED, WHITE, UNLIT] = Array.from(
    [0xd6e8da, 0x7dff73, 0xeef5ef, 0xe2402e, 0xfafaf6, 0x9fb59a],
    (each) => new three.Color(each),
  ),
  [ORANGE, OFF] = [
    [255, 140, 40],
    [0, 0, 0],
  ];

const painted = { vertexColors: true },
  over = { transparent: true, depthWrite: false };
/** Empty a group, and free what its meshes hold. */
const discard = (group: three.Group) => {
  for (const each of group.children as three.Mesh<three.BufferGeometry, three.Material>[]) {
    each.geometry.dispose();
    each.material.dispose();
  }
  group.clear();
};

const materials = {
  matte: new three.MeshLambertMaterial(),
  painted: new three.MeshLambertMaterial(painted),
  body: new three.MeshLambertMaterial({ transparent: true, opacity: 0.55 }),
  ring: new three.MeshLambertMaterial({ ...over, opacity: 0.62, side: three.DoubleSide }),
  lit: new three.MeshBasicMaterial(),
  flat: new three.MeshBasicMaterial({ ...over, opacity: 0.5 }),
  ribbon: new three.MeshBasicMaterial({ ...painted, ...over, side: three.DoubleSide }),
  halo: new three.PointsMaterial({ ...painted, ...over }),
  pool: new three.MeshBasicMaterial({ ...over, blending: three.AdditiveBlending }),
};
const box = new three.BoxGeometry(1, 1, 1).translate(0, 0, 0.5);
const shapes = {
  box,
  post: new three.CylinderGeometry(1, 1, 1, 40).rotateX(Math.PI / 2).translate(0, 0, 0.5),
  ball: new three.SphereGeometry(1, 28, 18).translate(0, 0, 1),
  bulb: new three.SphereGeometry(1, 16, 12),
  dot: new three.SphereGeometry(1, 6, 4), // there are nine on a robot
  side: new three.PlaneGeometry(1, 1).rotateX(Math.PI / 2).translate(0, 0, 0.5),
  sheet: new three.PlaneGeometry(2, 2),
  hoop: new three.RingGeometry(0.9, 1, 40),
};
let robot: ReturnType<typeof epuck> | null = null;
const drawn = new OffscreenCanvas(1, 1);
let renderer: three.WebGLRenderer | null = null;
const tint = new three.Color();
let level = 0; // an index of LEVELS
let pace = 0; // s for a picture, smoothed
let judged = 0; // pictures that went into it

/** What one side of a block shows, as thin plates before it: one for each run of cells of one colour. */
function printed(face: number[][], [x, y, , angle]: number[], turn: number, long: number, off: number, height: number) {
  const columns = face[0].length,
    cell = Math.min(long / columns, height / face.length),
    [c, s] = [Math.cos(angle + turn), Math.sin(angle + turn)],
    [ahead, top] = [-off - 0.0004, (height + face.length * cell) / 2],
    parts: Part[] = [];
  face.forEach((row, down) => {
    for (let k = 0, end = 0; k < columns; k = end) {
      while (end < columns && row[end] === row[k]) end++;
      const right = ((k + end - columns) / 2) * cell, // as it is seen from there
        ink = `#${row[k].toString(16).padStart(6, "0")}`,
        place = [x + c * right - s * ahead, y + s * right + c * ahead, top - (down + 1) * cell, angle + turn];
      parts.push([ink, place, (end - k) * cell, 0.0004, cell]);
    }
  });
  return parts;
}

/** The renderer, for pictures of that size; an error where the browser has no WebGL. */
function rendererOf(width: number, height: number) {
  if (!renderer) {
    const probe = document.createElement("canvas").getContext("webgl2");
    if (!probe) throw new Error("this browser has no WebGL");
    const names = probe.getExtension("WEBGL_debug_renderer_info"),
      isSoftware = /swiftshader|llvmpipe|softpipe|basic render/i.test(
        names ? probe.getParameter(names.UNMASKED_RENDERER_WEBGL) : "",
      );
    probe.getExtension("WEBGL_lose_context")?.loseContext();
    renderer = new three.WebGLRenderer({ canvas: drawn, antialias: !isSoftware, powerPreference: "high-performance" });
    renderer.localClippingEnabled = true;
    renderer.shadowMap.type = three.PCFShadowMap;
    level = isSoftware ? 2 : 0;
    const dot = document.createElement("canvas"),
      pen = dot.getContext("2d")!;
    dot.width = dot.height = 64;
    const shine = pen.createRadialGradient(32, 32, 0, 32, 32, 32);
    [1, 0.55, 0.16, 0].forEach((alpha, k) =>
      shine.addColorStop([0, 0.25, 0.55, 1][k], `rgba(255, 255, 255, ${alpha})`),
    );
    pen.fillStyle = shine;
    pen.fillRect(0, 0, 64, 64);
    materials.halo.map = materials.pool.map = new three.CanvasTexture(dot);
  }
  if (width !== drawn.width || height !== drawn.height) renderer.setSize(width, height, false);
  return renderer;
}

/** Something of a shape: x, y, height and angle of where it is, and how large it is along, across and up. */
type Part = [colour: three.ColorRepresentation, place: number[], along?: number, across?: number, up?: number];

/** Strips that lie flat: trails and rays. */
class Ribbon extends three.Mesh {
  private points = new Float32Array(0);
  private colours = new Float32Array(0);
  private strips = 0;

  constructor(private z: number) {
    super(new three.BufferGeometry(), materials.ribbon);
    this.frustumCulled = false;
  }

  begin(strips: number) {
    this.strips = 0;
    if (this.points.length >= 12 * strips) return;
    const room = 2 * strips;
    [this.points, this.colours] = [new Float32Array(12 * room), new Float32Array(16 * room)];
    this.geometry.dispose();
    this.geometry = new three.BufferGeometry();
    this.geometry.setAttribute("position", new three.BufferAttribute(this.points, 3).setUsage(three.DynamicDrawUsage));
    this.geometry.setAttribute("color", new three.BufferAttribute(this.colours, 4).setUsage(three.DynamicDrawUsage));
    const corners = Uint32Array.from({ length: 6 * room }, (_, k) => 4 * Math.floor(k / 6) + [0, 1, 2, 2, 1, 3][k % 6]);
    this.geometry.setIndex(new three.BufferAttribute(corners, 1));
  }

  /** Two ends: x, y, how wide it is there, and how opaque. */
  strip([x1, y1, from, a1]: number[], [x2, y2, to, a2]: number[], { r, g, b }: three.Color) {
    const far = 2 * Math.hypot(x2 - x1, y2 - y1) || 1,
      [u, v] = [(y1 - y2) / far, (x2 - x1) / far],
      { z } = this;
    // prettier-ignore
    this.points.set([x1 + u * from, y1 + v * from, z, x1 - u * from, y1 - v * from, z, x2 + u * to, y2 + v * to, z, x2 - u * to, y2 - v * to, z], 12 * this.strips);
    this.colours.set([r, g, b, a1, r, g, b, a1, r, g, b, a2, r, g, b, a2], 16 * this.strips++);
  }

  end() {
    this.geometry.setDrawRange(0, 6 * this.strips);
    for (const each of Object.values(this.geometry.attributes)) each.needsUpdate = true;
  }
}

export class View extends Stage {
  private readonly room = new three.Scene();
  private readonly sun = new three.DirectionalLight();
  private readonly picture = document.createElement("canvas");
  private readonly sky = new three.HemisphereLight();
  private readonly meshes = new Map<string, three.InstancedMesh>();
  private readonly trails = new Ribbon(0.0015);
  private readonly rays = new Ribbon(0.031);
  private readonly zones = new three.Group();
  private readonly lids = new three.Group(); // of the blocks, whose sides are walls
  private halos = new three.Points(new three.BufferGeometry(), materials.halo);
  private floor: three.Mesh<three.PlaneGeometry, three.MeshLambertMaterial> | null = null;
  private built: unknown[] = [];
  private later = 0; // the timer that draws it well
  private isStill = false; // and that it is being drawn so

  constructor(canvas: HTMLCanvasElement, world: World) {
    rendererOf(1, 1); // first of all: where it fails, nothing listens yet
    super(canvas, world);
    robot ??= epuck(hello.value!);
    this.picture.className = "world-picture over";
    canvas.before(this.picture);
    this.halos.frustumCulled = false;
  }

  override close() {
    super.close();
    clearTimeout(this.later);
    this.picture.remove();
    this.clear();
  }

  protected override redress() {
    this.built = [];
    super.redress();
  }

  private colour = (name: string) => new three.Color(this.ink(name));

  /** Put all parts of one shape into the room; they are drawn at once. */
  private fill(name: string, shape: three.BufferGeometry, material: three.Material, parts: Part[], casts = true) {
    let mesh = this.meshes.get(name);
    if (!mesh || mesh.instanceMatrix.count < parts.length) {
      mesh?.removeFromParent().dispose();
      mesh = new three.InstancedMesh(shape, material, Math.max(1, parts.length));
      mesh.frustumCulled = false;
      mesh.castShadow = casts;
      mesh.receiveShadow = material === materials.matte;
      this.meshes.set(name, mesh);
      this.room.add(mesh);
    }
    mesh.count = parts.length;
    for (const [k, [colour, [x, y, z = 0, angle = 0], along = 1, across = along, up = along]] of parts.entries()) {
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      // prettier-ignore
      mesh.instanceMatrix.array.set([c * along, s * along, 0, 0, -s * across, c * across, 0, 0, 0, 0, up, 0, x, y, z, 1], 16 * k);
      mesh.setColorAt(k, tint.set(colour));
    }
    mesh.instanceMatrix.needsUpdate = true;
    if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
  }

  private clear() {
    for (const each of this.meshes.values()) each.dispose();
    this.meshes.clear();
    this.floor?.material.map?.dispose();
    this.floor?.material.dispose();
    discard(this.lids);
    this.room.clear();
  }

  /** Build what belongs to the room itself. */
  private enter() {
    const { width, depth, floor, floor_png, blocks } = this.world.scene.value!;
    this.clear();
    this.room.background = this.colour("room");
    const size = Math.hypot(width, depth),
      { sun, sky } = this;
    sun.position.set(width / 2 - 0.55 * size, depth / 2 - 0.4 * size, 1.3 * size);
    sun.target.position.set(width / 2, depth / 2, 0);
    const reach = 0.6 * size;
    sun.shadow.camera = new three.OrthographicCamera(-reach, reach, reach, -reach, 0.3 * size, 2.5 * size);
    Object.assign(sun.shadow, { radius: 3, intensity: 0.8, normalBias: 0.004 });
    sun.color = this.colour("sun");
    [sky.color, sky.groundColor] = [this.colour("sky"), this.colour("bounce")];
    const ground = new three.MeshLambertMaterial({ color: this.ink(floor.colour || floor_png ? "paint" : "floor") });
    this.floor = new three.Mesh(new three.PlaneGeometry(width, depth), ground);
    this.floor.position.set(width / 2, depth / 2, 0);
    this.floor.receiveShadow = true;
    // A lamp's light ends where the floor does.
    // prettier-ignore
    const inside = [[1, 0, 0], [-1, 0, width], [0, 1, 0], [0, -1, depth]];
    materials.pool.clippingPlanes = inside.map(([x, y, far]) => new three.Plane(new three.Vector3(x, y, 0), far));
    if (floor_png) {
      ground.map = new three.TextureLoader().load(floor_png, () => this.invalidate());
      ground.map.colorSpace = three.SRGBColorSpace;
      ground.map.anisotropy = 8;
      ground.map.repeat.set(width / floor.width, depth / floor.depth);
      if (!floor.colour) {
        // The picture is transparent where nothing is painted.
        const bare = new three.Mesh(this.floor.geometry, new three.MeshLambertMaterial({ color: this.ink("floor") }));
        bare.position.set(width / 2, depth / 2, -0.0005);
        bare.receiveShadow = ground.transparent = true;
        this.floor.renderOrder = -1; // what lies on it is transparent, too
        this.room.add(bare);
      }
    } else {
      if (floor.colour) ground.color.multiply(new three.Color(floor.colour));
      const lines: three.Vector3[] = [],
        line = (...ends: [number, number][]) => lines.push(...ends.map(([x, y]) => new three.Vector3(x, y, 0.0005)));
      for (let x = 0.1; x < width - 1e-6; x += 0.1) line([x, 0], [x, depth]);
      for (let y = 0.1; y < depth - 1e-6; y += 0.1) line([0, y], [width, y]);
      const opacity = floor.colour ? 0.3 : 1,
        ink = new three.LineBasicMaterial({ color: this.ink("grid"), opacity, transparent: true });
      this.room.add(new three.LineSegments(new three.BufferGeometry().setFromPoints(lines), ink));
    }
    // Those of the four walls that are nearer than the floor are seen through: they have only an inner side.
    const { matte } = materials,
      around = [
        [width / 2, 0, Math.PI, width],
        [width, depth / 2, -Math.PI / 2, depth],
        [width / 2, depth, 0, width],
        [0, depth / 2, Math.PI / 2, depth],
      ];
    const sides = around.map(([x, y, angle, long]): Part => [this.ink("panel"), [x, y, 0, angle], long, 1, 0.1]);
    const rims = around.map(([x, y, angle, long]): Part => {
      const place = [x - 0.0045 * Math.sin(angle), y + 0.0045 * Math.cos(angle), -0.002, angle];
      return [this.ink("wall"), place, long + 0.017, 0.008, 0.004];
    });
    this.fill("sides", shapes.side, matte, sides, false);
    this.fill("rims", box, matte, rims, false);
    for (const { points, height, colour } of blocks) {
      const shape = new three.Shape(points.map(([x, y]) => new three.Vector2(x, y))),
        lid = new three.Mesh(new three.ShapeGeometry(shape), new three.MeshLambertMaterial({ color: colour }));
      lid.position.z = height - 0.0005; // the sides reach a little over it
      lid.castShadow = lid.receiveShadow = true;
      this.lids.add(lid);
    }
    const lamps = this.world.things.value.light.slice(0, SHINING).map(() => new three.PointLight("#ffcf70"));
    this.room.add(
      sun,
      sun.target,
      sky,
      this.floor,
      this.lids,
      this.zones,
      this.trails,
      this.rays,
      this.halos,
      ...lamps,
    );
  }

  /** Lay the zones on the floor, darker while they are switched on. */
  private layZones() {
    discard(this.zones);
    for (const { points, colour, on, picture } of this.world.zones.value) {
      const corners = points.map(([x, y]) => new three.Vector2(x, y)),
        ink = { color: colour, transparent: true, depthWrite: false, opacity: picture ? 0 : on ? 0.45 : 0.18 },
        area = new three.Mesh(new three.ShapeGeometry(new three.Shape(corners)), new three.MeshBasicMaterial(ink)),
        rim = new three.LineLoop(
          new three.BufferGeometry().setFromPoints(corners),
          new three.LineBasicMaterial({ color: colour }),
        );
      area.position.z = rim.position.z = 0.0008;
      this.zones.add(area, rim);
    }
  }

  /** Put all things where they are; called when they have changed, or move. */
  private placeThings(now: number) {
    const { wall, box: boxes, cylinder, light, sound } = this.world.things.value,
      { matte, lit, pool, flat } = materials,
      [boxPoses, postPoses] = [this.world.shown("box", now), this.world.shown("cylinder", now)],
      [posts, balls]: Part[][] = [[], []];
    const cells: Part[] = [];
    const blocks = [...wall, ...boxes].map(({ x, y, angle, width, depth, height, colour, face }, at): Part => {
      const k = at - wall.length,
        place = k < 0 ? [x, y, 0, angle] : [boxPoses[3 * k], boxPoses[3 * k + 1], 0, boxPoses[3 * k + 2]];
      for (let side = 0; face.length && side < 4; side += k < 0 ? 2 : 1) {
        const [long, off] = side % 2 ? [depth, width / 2] : [width, depth / 2];
        cells.push(...printed(face, place, (side * Math.PI) / 2, long, off, height));
      }
      return [colour, place, width, depth, height];
    });
    cylinder.forEach(({ radius, height, colour, pushable }, k) => {
      const place = [postPoses[3 * k], postPoses[3 * k + 1]];
      // What gives way and is as wide as it is high is a ball.
      if (pushable && Math.abs(height - 2 * radius) < 0.2 * radius) balls.push([colour, place, radius]);
      else posts.push([colour, place, radius, radius, height]);
    });
    const shining = this.room.children.filter((each): each is three.PointLight => each instanceof three.PointLight),
      bulbs: Part[] = [],
      pools: Part[] = [],
      waves: Part[] = [];
    light.forEach(({ x, y, height, intensity }, k) => {
      bulbs.push([intensity ? "#ffe39a" : "#8a8f98", [x, y, height], 0.013]);
      posts.push([this.ink("wall"), [x, y], 0.0025, 0.0025, height]);
      pools.push([this.ink("pool"), [x, y, 0.001], Math.min(intensity, 3)]); // half of it, in m, is where it falls to 1/e
      shining[k]?.position.set(x, y, height + 0.02);
      if (shining[k]) shining[k].intensity = 0.05 * intensity;
    });
    for (const { x, y, volume } of sound) {
      const colour = this.ink("noise");
      posts.push([colour, [x, y], 0.012, 0.012, 0.03]);
      for (let ring = 0; volume > 0 && ring <= Math.min(2, volume / 1000); ring++)
        waves.push([colour, [x, y, 0.001], 0.022 + 0.014 * ring]);
    }
    this.fill("blocks", box, matte, blocks);
    this.fill("cells", box, matte, cells, false);
    this.fill("posts", shapes.post, matte, posts);
    this.fill("balls", shapes.ball, matte, balls);
    this.fill("bulbs", shapes.bulb, lit, bulbs, false);
    this.fill("pools", shapes.sheet, pool, pools, false);
    this.fill("waves", shapes.hoop, flat, waves, false);
  }

  private placeRobots(now: number) {
    const { radius } = this.world.scene.value!,
      frame = this.world.frame.value!,
      { leds: angles } = hello.value!.ring,
      { count, bits, ring } = frame,
      poses = this.world.shown("robot", now),
      size = radius / 0.037,
      [solid, body, hoop, arrow, leds]: Part[][] = [[], [], [], [], []];
    const spots: number[] = [],
      shine: number[] = [];
    for (let k = 0; k < count; k++) {
      const [x, y, heading] = poses.subarray(3 * k),
        scale = this.mode.value === "eye" && k === this.chosen ? 0 : size,
        [c, s] = [scale * Math.cos(heading), scale * Math.sin(heading)];
      const place = [x, y, 0, heading];
      solid.push([WHITE, place, scale]);
      body.push([bits[k] & FRAME.body ? GREEN : CLEAR, place, scale]);
      hoop.push([bits[k] & FRAME.touching ? RED : PALE, place, scale]);
      arrow.push([WHITE, place, scale]);
      if (bits[k] & FRAME.body && scale) {
        spots.push(x, y, 0.02);
        shine.push(0.3, 1, 0.28, 0.5);
      }
      for (let led = 0; led < 9; led++) {
        const isFront = led === 8,
          turn = angles[led] ?? 0,
          [ahead, left] = isFront ? [0.033, -0.0125] : [0.0342 * Math.cos(turn), 0.0342 * Math.sin(turn)],
          z = (isFront ? 0.0285 : LED_HEIGHT) * size,
          at = [x + c * ahead - s * left, y + s * ahead + c * left, z],
          [r, g, b] = isFront ? (bits[k] & FRAME.front ? ORANGE : OFF) : ring.subarray(24 * k + 3 * led),
          isLit = r + g + b > 0,
          colour = new three.Color();
        if (isLit) colour.setRGB(r / 255, g / 255, b / 255, three.SRGBColorSpace).lerp(WHITE, 0.25);
        leds.push([isLit ? colour : UNLIT, at, scale && (isLit ? 0.0034 : isFront ? 0 : 0.0019)]);
        if (!isLit || !scale) continue;
        spots.push(...at);
        shine.push(r / 255, g / 255, b / 255, 0.85);
      }
    }
    this.fill("solid", robot!.solid, materials.painted, solid, false);
    this.fill("body", robot!.body, materials.body, body);
    this.fill("ring", robot!.ring, materials.ring, hoop, false);
    this.fill("arrow", robot!.arrow, materials.lit, arrow, false);
    this.fill("leds", shapes.dot, materials.lit, leds, false);
    this.halos.geometry.dispose();
    this.halos.geometry = new three.BufferGeometry();
    this.halos.geometry.setAttribute("position", new three.Float32BufferAttribute(spots, 3));
    this.halos.geometry.setAttribute("color", new three.Float32BufferAttribute(shine, 4));
    this.halos.visible = spots.length > 0;
  }

  private drawRibbons() {
    const { trails, rays } = this,
      paths = this.hasTrails.value ? this.world.trails : [],
      found = this.world.frame.value?.rays ?? new Float32Array(0),
      [far, near] = [this.colour("ray-far"), this.colour("ray")];
    const { lines } = this.world;
    trails.begin([...paths, ...lines].reduce((sum, { length }) => sum + length, 0));
    lines.forEach((line, robot) => {
      const ink = new three.Color(this.world.scene.value!.pens[robot] ?? 0);
      for (let k = 1; k < line.length; k++) trails.strip([...line[k - 1], PEN, 1], [...line[k], PEN, 1], ink);
    });
    paths.forEach((path, robot) => {
      const hue = new three.Color(this.hue(robot));
      let last: number[] | null = null;
      path.forEach(([x, y], k) => {
        const end = [x, y, 0.004, 0.2 + (0.75 * k) / path.length];
        if (last) trails.strip(last, end, hue);
        last = end;
      });
    });
    trails.end();
    rays.begin((2 * found.length) / 5);
    for (let k = 0; k < found.length; k += 5) {
      const [x1, y1, x2, y2, strength] = found.subarray(k),
        lit = Math.min(1, 4 * strength), // a quarter of full scale is very near already
        [width, from, to] = lit > 0.02 ? [0.006 + 0.004 * lit, 1, 0.85] : [0.006, 0.85, 0.15];
      rays.strip([x1, y1, 0.005, from], [x2, y2, width + 0.003, to], PALE); // without it none is seen on a green floor
      rays.strip([x1, y1, 0.002, from], [x2, y2, width, to], far.clone().lerp(near, lit));
    }
    rays.end();
  }

  protected paint(now: number, passed: number) {
    const { scene, things, zones, frame, ambient } = this.world,
      { canvas, sun } = this;
    const isNew = this.built[0] !== scene.value || this.built[2] !== things.value.light.length;
    if (isNew) this.enter();
    if (isNew || this.built[3] !== zones.value) this.layZones();
    if (isNew || this.built[1] !== things.value || this.world.isMoving(now)) this.placeThings(now);
    this.built = [scene.value, things.value, things.value.light.length, zones.value];
    if (frame.value) this.placeRobots(now);
    this.drawRibbons();
    const light = Math.min(1.2, (DARK - ambient.value) / (DARK - ROOM)),
      bright = 0.35 + 0.65 * light;
    sun.intensity = 1.75 * bright;
    this.sky.intensity = 1.9 * bright;

    // How well: as the last pictures took long or not, and as well as can be if it stands still.
    if (passed > 0) {
      pace += (passed - pace) / Math.min(++judged, PATIENCE);
      if (judged > PATIENCE && pace > SLOW && level < LEVELS.length - 1) [level, judged] = [level + 1, 0];
    }
    clearTimeout(this.later);
    const { isStill } = this;
    if (level && !isStill) this.later = setTimeout(() => this.drawStill(), STILL);
    const [share, shadows] = LEVELS[isStill ? 0 : level],
      ratio = share * (isStill && level && this.density < 2 ? 2 : 1),
      [width, height] = [Math.round(canvas.width * ratio), Math.round(canvas.height * ratio)],
      mapSize = this.isSmall ? Math.min(512, shadows) : shadows,
      drawing = rendererOf(width, height);
    drawing.shadowMap.enabled = true;
    sun.castShadow = mapSize > 0;
    if (mapSize && sun.shadow.mapSize.x !== mapSize) {
      sun.shadow.mapSize.set(mapSize, mapSize);
      sun.shadow.map?.dispose();
      sun.shadow.map = null;
    }
    // Points are as large as the renderer's whole picture and a field of view of 90 degrees would have them.
    materials.halo.size = (HALO * this.focal * ratio * this.density * 2) / height;
    drawing.render(this.room, this.camera);
    this.picture.getContext("bitmaprenderer")!.transferFromImageBitmap(drawn.transferToImageBitmap());
  }

  private drawStill() {
    this.isStill = true;
    this.draw();
    this.isStill = false;
  }
}

/** A picture of a world on a canvas, unless that is gone meanwhile: in three dimensions, or flat without WebGL. */
export function stageOf(canvas: HTMLCanvasElement, world: World): Stage | null {
  if (!canvas.isConnected) return null;
  try {
    return new View(canvas, world);
  } catch {
    return new Flat(canvas, world);
  }
}
