// What the page may ask for and what it is told, by the classes of elib. Do not edit; renew it with:
// .venv/bin/python docs/generate_reference.py

/** What the page may ask for: the fields of each request. */
export type Asked = {
  /** Be told so many times a second of a robot or a world by its key, or of a robot of that world by its index there. */
  subscribe: {
    what: "overview" | "readings" | "robot" | "study" | "world";
    of?: string;
    rate?: number;
    channel?: number;
    rays?: boolean;
  };
  /** Say that the page has drawn an update. */
  drawn: { number: number };
  /** Say which frames of worlds the page has drawn: channel and number of each, the newest of a channel is enough. */
  frames_drawn: { frames: [number, number][] };
  /** Look for robots on this computer's ports, and for virtual ones that run here. */
  find: Record<string, never>;
  /** Name the robots that were used before, the newest first. */
  recents: Record<string, never>;
  /** Forget a robot that was used before. */
  forget: { url: string };
  /** Take the robots of a URL into the panel, and connect them. */
  add: { url: string };
  /** Disconnect a robot and take it out of the panel. */
  remove: { robot: string };
  /** Connect a robot. */
  connect: { robot: string };
  /** Stop a robot and close its link. */
  disconnect: { robot: string };
  /** Turn the wheels, as shares of the fastest that is allowed. */
  steer: { robot: string; left: number; right: number };
  /** Say that the page is still there, and drives. */
  beat: { robot: string };
  /** Drive no more: the page is hidden, or shows something else. */
  leave: { robot: string };
  /** Drive a robot that another page drives; the person was asked. */
  take_over: { robot: string };
  /** Set the fastest wheel, as a share of what the robot can do. */
  limit: { robot: string; share: number };
  /** Stop one robot, or all of them. */
  stop: { robot?: string };
  /** Send one command of the table. */
  command: { robot: string; name: string; arguments?: (number | string)[] };
  /** Send a line that a person typed. */
  console: { robot: string; line: string };
  /** Ask what a line that a person types may become, and what it means. */
  complete: { robot: string; line: string };
  /** Let all LEDs of a robot blink for a moment, so that a person finds it. */
  blink: { robot: string };
  /** Set the camera and take a picture. */
  set_camera: { robot: string; width: number; height: number; zoom: number; mode: "COLOUR" | "GREY" };
  /** Take one picture. */
  picture: { robot: string };
  /** Take a picture every so many seconds; null takes no more. */
  live: { robot: string; seconds: number | null };
  /** Start a behaviour on some robots. */
  behave: { robots: string[]; name: string; options?: Record<string, boolean | number | string> | null };
  /** Let the behaviour of some robots wait. */
  pause_behaviour: { robots: string[] };
  /** Let the behaviour of some robots go on. */
  resume_behaviour: { robots: string[] };
  /** End the behaviour of some robots. */
  end_behaviour: { robots: string[] };
  /** Ask for the source text of a behaviour. */
  source: { name: string };
  /** Ask for the picture of the states of a robot, an SVG document; an empty text without a machine of states. */
  states: { robot: string };
  /** Ask which logs and recordings the folder has, and for free names of new ones. */
  files: Record<string, never>;
  /** Write a log; if the robot is not connected yet, from the moment it is. */
  start_log: { robot: string; name: string };
  /** Write the log no more. */
  stop_log: { robot: string };
  /** Record everything; if the robot is not connected yet, from the moment it is. */
  start_recording: { robot: string; name: string };
  /** Record no more. */
  stop_recording: { robot: string };
  /** Save what a robot's infrared sensors have met: as a picture, its TOML file, and a world. */
  save_map: { robot: string; name: string };
  /** Play a recording of the folder as a robot of the panel. */
  open_recording: { name: string };
  /** Go on with a recording from another moment of it. */
  seek: { robot: string; seconds: number };
  /** Hold a recording, or let it go on. */
  pause_playback: { robot: string; on: boolean };
  /** Let one of the best controllers of the study drive in the world; null for the newest at any time. */
  choose_controller: { number: number | null };
  /** Save the world of a channel, as it is now, as a world file of the folder. */
  save_world: { name: string; about?: string; channel?: number };
  /** Let the world of a channel go on from a moment of its last minute, s; its robots of this panel are stopped first. */
  go_back: { time: number; channel?: number };
  /** Lift a robot and put it down elsewhere; its wheels go on turning. */
  move_robot: { robot: number | string; x: number; y: number; heading?: number | null; channel?: number };
  /** Put a box down elsewhere. */
  move_box: { box: number | string; x: number; y: number; angle?: number | null; channel?: number };
  /** Put a cylinder down elsewhere. */
  move_cylinder: { cylinder: number | string; x: number; y: number; channel?: number };
  /** Put another box into the world, and return its index. */
  add_box: {
    x: number;
    y: number;
    angle?: number;
    width?: number;
    depth?: number;
    pushable?: boolean;
    colour?: string;
    channel?: number;
  };
  /** Take a box out of the world; those counted behind it move up. */
  remove_box: { box: number | string; channel?: number };
  /** Put another wall into the world, and return its index. */
  add_wall: { x1: number; y1: number; x2: number; y2: number; colour?: string; channel?: number };
  /** Put the ends of a wall elsewhere; arguments as of add_wall. */
  move_wall: { wall: number | string; x1: number; y1: number; x2: number; y2: number; channel?: number };
  /** Take a wall out of the world; those counted behind it move up. */
  remove_wall: { wall: number | string; channel?: number };
  /** Change a lamp; an argument that is None changes nothing. */
  set_light: {
    light: number | string;
    intensity?: number | null;
    x?: number | null;
    y?: number | null;
    height?: number | null;
    channel?: number;
  };
  /** Change a source of sound; an argument that is None changes nothing. */
  set_sound: {
    sound: number | string;
    volume?: number | null;
    frequency?: number | null;
    x?: number | null;
    y?: number | null;
    channel?: number;
  };
  /** Switch a zone of the world on or off, and with it its doors, lamps and sounds. */
  switch: { zone: string; on?: boolean | null; channel?: number };
  /** Set what the infrared sensors read in the room's light. */
  set_ambient: { ambient: number; channel?: number };
  /** Turn the rotary switch of a robot. Its firmware reads it when it is asked, and when it starts. */
  turn_selector: { robot: number | string; position: number; channel?: number };
  /** Press a key of an infrared remote control that points at a robot. */
  press_remote: { robot: number | string; key: number; address?: number; channel?: number };
  /** Hold the user button of an e-puck2 down, or release it. */
  press_button: { robot: number | string; pressed?: boolean; channel?: number };
  /** Switch a robot off and on. It stops, and its program loses a connection over Wi-Fi. */
  restart: { robot: number | string; channel?: number };
  /** Let the world stand still, with the robots' firmwares and links. */
  pause: { channel?: number };
  /** End a pause. */
  resume: { channel?: number };
  /** Let a paused world go on by some time. */
  step: { seconds?: number | null; channel?: number };
  /** Let the world run faster or slower; programs keep their own time. */
  set_speed: { speed: number; channel?: number };
  /** Make a robot's link worse, in addition to its settings and its fault script. */
  set_faults: {
    robot: number | string;
    latency?: number | null;
    jitter?: number | null;
    loss?: number | null;
    channel?: number;
  };
  /** Break a part of a robot, on top of its fault script; with nothing wrong, mend what was broken so by hand. */
  set_defect: {
    robot: number | string;
    of: string;
    number?: number | null;
    factor?: number;
    shift?: number;
    noise?: number;
    stuck?: number | null;
    channel?: number;
  };
  /** Mend all parts of a robot, also those that a fault script broke: it may break some again when it goes on. */
  mend_parts: { robot: number | string; channel?: number };
  /** Cut a robot's link: its program loses it, and no program can open it until mend. */
  cut: { robot: number | string; channel?: number };
  /** Let programs open a robot again. What a fault script cut stays cut as long as the script says. */
  mend: { robot: number | string; channel?: number };
};

/** What requests are answered with; all others with null. */
export type Answered = {
  find: Found[];
  recents: string[];
  forget: string[];
  add: string[];
  steer: boolean;
  beat: boolean;
  command: string;
  console: ConsoleAnswer;
  complete: Completions;
  source: string;
  states: string;
  files: FileList;
  save_map: Saved;
  open_recording: string[];
  save_world: Saved;
  add_box: number;
  add_wall: number;
};

/** A frame: bytes of its header, flags for rays and for a moment to go back to, bits of a robot. */
export const FRAME = { header: 24, rays: 1, kept: 2, touching: 1, body: 2, front: 4, cut: 8 };

/** What the page is told without having asked. */
export type Told = Hello | Update | NewScene | Change | Readings | Error;

/** A link that may lead to a robot. */
export type Found = {
  url: string;
  kind: "bluetooth" | "serial" | "simulation" | "wifi";
  description: string;
  firmware: string | null;
  answer: string;
  reason: string;
};

/** What the console says to a line, in lines of plain text, and whether it went wrong or the robot refused. */
export type ConsoleAnswer = {
  text: string;
  is_bad: boolean;
};

/** What a line may become, and what it means. */
export type Completions = {
  choices: string[];
  help: string;
};

/** The recordings of the folder, the newest first, and free names for a new log and recording. */
export type FileList = {
  recordings: [string, number, number][];
  log: string;
  recording: string;
};

/** A file that was saved, and the URL that opens its world. */
export type Saved = {
  name: string;
  url: string;
};

/** What a page is told once. */
export type Hello = {
  type: "hello";
  page: string;
  can: Can;
  folder: string;
  worlds: WorldInfo[];
  behaviours: BehaviourAbout[];
  robots: Reachable[];
  study: StudyAbout | null;
  kinds: Record<string, string>;
  ring: Ring;
  body: Body;
};

/** What has changed; a page says ``drawn`` with its number. */
export type Update = {
  type: "update";
  number: number;
  place: string;
  robots?: Listed[];
  robot?: RobotNews;
  overview?: Record<string, Summary>;
  worlds?: [string, string][];
  study?: StudyNews;
};

/** The world of a channel from now on, or that there is none. */
export type NewScene = {
  type: "scene";
  channel: number;
  scene: Scene | null;
};

/** What stands elsewhere or shines otherwise than before, each with its index; or all of a kind. */
export type Change = {
  type: "change";
  channel: number;
  walls?: [number, number, number, number, string, number, number[][]][];
  all_boxes?: Box[];
  boxes?: [number, number, number, number][];
  cylinders?: [number, number, number][];
  lights?: [number, Light][];
  sounds?: [number, Sound][];
  zones?: Zone[];
  ambient?: number;
  clock?: Clock;
};

/** What one robot of the world perceives and how it is connected; the last three only if a program has opened it. */
export type Readings = {
  type: "readings";
  channel: number;
  robot: number;
  proximity: number[];
  encoders: [number, number];
  link: LinkState;
  energy: number;
  score: number;
  zones: string[];
  base?: LinkFaults;
  selector?: number;
  button?: boolean | null;
};

/** The answer to a request that was carried out. */
export type Answer = {
  type: "answer";
  id: number;
  ok: true;
  result: unknown;
};

/** The answer to a request that failed. */
export type Failure = {
  type: "answer";
  id: number;
  ok: false;
  error: Trouble;
};

/** The failure of a request without a number, or something that went wrong without a request. */
export type Error = {
  type: "error";
  robot: string;
  error: Trouble;
};

/** What the pages of a panel can do. */
export type Can = {
  drive: boolean;
  edit: boolean;
  speed: boolean;
  save: boolean;
  connect: boolean;
  files: boolean;
  program: boolean;
};

/** A world that comes with elib: a sentence about it, number of robots, and their firmwares. */
export type WorldInfo = {
  name: string;
  about: string;
  robots: number;
  firmware: string;
};

/** A behaviour to choose: the world that it is made for, and why it cannot run here, if it cannot. */
export type BehaviourAbout = {
  name: string;
  group: string;
  summary: string;
  world: string;
  elsewhere: string;
  options: BehaviourOption[];
};

/** A robot of a world that programs can open: its name there, and its URL. */
export type Reachable = {
  name: string;
  url: string;
};

/** A study: its task, how many generations it is to have, and s that a robot has. */
export type StudyAbout = {
  task: string;
  summary: string;
  count: number;
  seconds: number;
  settings: Record<string, string>;
};

/** Where on the robot the infrared sensors look and the LEDs sit, rad from straight ahead, positive to the left. */
export type Ring = {
  sensors: number[];
  leds: number[];
};

/** The robot in m: its body, its wheels, the infrared sensors' distance from the axis, and its camera. */
export type Body = {
  height: number;
  axle: number;
  wheel: number;
  sensor_radius: number;
  eye: [number, number];
  focal: number;
};

/** A robot of the panel: its key, its name as a tab shows it, and its URL. */
export type Listed = {
  key: string;
  label: string;
  url: string;
  world: string;
  index: number | null;
};

/** What is new of a robot; its scheme only if that is. */
export type RobotNews = {
  tick: Tick;
  behaviour: Play;
  scheme?: Scheme;
};

/** The part of a tick that an overview of many robots draws. */
export type Summary = {
  phase: "disconnected" | "connecting" | "connected" | "gap" | "playing" | "watched" | "failed";
  phase_text: string;
  error: string | null;
  may_move: boolean;
  driver: string;
  behaviour: string;
  distances: (number | null)[];
  battery: number | null;
  stale: boolean;
  median: number | null;
};

/** How far the study is, with the generations from the first on that the page does not know yet. */
export type StudyNews = {
  bests: [number, number][];
  left: number;
  outcome: string;
  chosen: number | null;
  shown: number | null;
  first: number;
  generations: [number, number, number, number, number][];
};

/** What the page has to know once of a world: m, and counts of the room's light. */
export type Scene = {
  world: string;
  width: number;
  depth: number;
  walls: [number, number, number, number, string, number, number[][]][];
  blocks: Block[];
  floor: Floor;
  robots: number;
  radius: number;
  boxes: Box[];
  cylinders: Cylinder[];
  lights: Light[];
  sounds: Sound[];
  ambient: number;
  clock: Clock;
  names: string[];
  own: number | null;
  floor_png: string | null;
  zones: Zone[];
  pens: (string | null)[];
};

/** A box: m, rad, whether it gives way to a robot, and what its sides show, as a wall. */
export type Box = {
  name: string;
  x: number;
  y: number;
  angle: number;
  width: number;
  depth: number;
  height: number;
  colour: string;
  pushable: boolean;
  face: number[][];
};

/** A lamp that shines on all sides. */
export type Light = {
  x: number;
  y: number;
  height: number;
  intensity: number;
  name: string;
  switch: string;
};

/** A source of sound: a tone or a noise, steady or again and again. */
export type Sound = {
  x: number;
  y: number;
  volume: number;
  frequency: number;
  every: number;
  lasts: number;
  name: string;
  switch: string;
};

/** A zone of the world: the corners of its shape, m, whether it is switched on, and whether a picture tells more. */
export type Zone = {
  name: string;
  points: [number, number][];
  colour: string;
  on: boolean;
  picture: boolean;
};

/** The clock of a world: how often faster than the wall clock, and why its speed cannot be changed, if it cannot. */
export type Clock = {
  paused: boolean;
  speed: number;
  fixed: string;
};

/** How a robot is connected. */
export type LinkState = {
  connected: boolean;
  cut: boolean;
  latency: number;
  jitter: number;
  loss: number;
  script: string[];
  broken: string[];
};

/** Faults of a link: delay of answers and its standard deviation, s, and the probability of a loss. */
export type LinkFaults = {
  latency: number;
  jitter: number;
  loss: number;
};

/** Why a request was not carried out. */
export type Trouble = {
  kind: string;
  message: string;
  hint: string;
};

/** An option of a behaviour; a whole one takes only whole numbers. */
export type BehaviourOption = {
  name: string;
  unit: string;
  low: number | null;
  high: number | null;
  default: number | string | null;
  whole: boolean;
  rule: string;
};

/** What changes ten times a second; distances are those to a white wall, m, and null where nothing is seen. */
export type Tick = {
  time: number;
  phase: "disconnected" | "connecting" | "connected" | "gap" | "playing" | "watched" | "failed";
  phase_text: string;
  error: Trouble | null;
  doctor: DiagnosedStep[] | null;
  drive: Drive;
  readings: Record<string, Reading>;
  lamps: Lamps;
  camera: CameraSettings | null;
  picture: Picture | null;
  distances: (number | null)[];
  pose: [number, number, number] | null;
  trail: Trail;
  map: MapPart | null;
  lines: Lines;
  link: LinkStats | null;
  log: string | null;
  recorder: number | null;
  playback: Playing | null;
  machine: MachineState | null;
  live: number | null;
};

/** How a behaviour stands: s that it has run, lines that it ever said, and those that the page does not have yet. */
export type Play = {
  name: string;
  phase: "idle" | "running" | "paused" | "ended" | "stopped" | "failed";
  phase_text: string;
  state: string;
  reason: string;
  error: string;
  time: number;
  count: number;
  lines: [number, string][];
};

/** What seldom changes of a robot. */
export type Scheme = {
  scheme: number;
  firmware: string;
  fastest: number;
  circumference: number;
  instruments: Instrument[];
  camera: CameraLimits | null;
  coloured: number[];
  sounds: string[];
};

/** A fixed block: its corners, m, its height, m. Its sides are among the walls. */
export type Block = {
  points: [number, number][];
  height: number;
  colour: string;
};

/** The painted floor, if there is a picture of it; without a colour, it is bare linoleum. */
export type Floor = {
  colour: string | null;
  width: number;
  depth: number;
};

/** A cylinder: m, and whether it gives way to a robot. */
export type Cylinder = {
  name: string;
  x: number;
  y: number;
  radius: number;
  height: number;
  colour: string;
  pushable: boolean;
};

/** What the doctor found in one step, and what to do. */
export type DiagnosedStep = {
  name: string;
  state: "failed" | "ok" | "skipped" | "warning";
  detail: string;
  fix: string;
};

/** Who drives, how fast (rev/s), how fast it may be at most, and whether the robot may move. */
export type Drive = {
  driver: string;
  left: number | null;
  right: number | null;
  limit: number;
  may_move: boolean;
  trouble: string;
};

/** The numbers of a reading as its instrument names them, and the same in a physical unit if it has one. */
export type Reading = {
  values: (number | boolean | null)[] | null;
  physical: (number | null)[] | null;
  age: number | null;
  stale: boolean;
};

/** Which LEDs are on; the colours, in %, of an e-puck2. */
export type Lamps = {
  ring: number[];
  body: number;
  front: number;
  rgb: number[][] | null;
};

/** How the camera is set. */
export type CameraSettings = {
  width: number;
  height: number;
  zoom: number;
  mode: string;
};

/** The newest picture; its pixels only if the page does not have them yet. */
export type Picture = {
  width: number;
  height: number;
  mode: "GREY" | "COLOUR";
  age: number | null;
  stale: boolean;
  pixels: string | null;
};

/** Points where the robot was, m: those that are new to the page, or the whole trail. */
export type Trail = {
  whole: boolean;
  points: [number, number][];
};

/** A part of what the infrared sensors have met; it is new to the page, and stands in its last map if that fits. */
export type MapPart = {
  cell: number;
  x: number;
  y: number;
  columns: number;
  rows: number;
  at: [number, number];
  width: number;
  squares: string;
};

/** Lines of the event log: those that are new to the page, or all. */
export type Lines = {
  whole: boolean;
  lines: Line[];
};

/** Statistics of the link, s and counts, and the share of lost and refused commands. */
export type LinkStats = {
  median: number | null;
  p99: number | null;
  count: number;
  lost: number;
  refused: number;
  unsent: number;
  resyncs: number;
  resets: number;
  loss: number | null;
  age: number | null;
  waiting: number;
};

/** How far a recording was played, s. */
export type Playing = {
  at: number;
  length: number;
  paused: boolean;
};

/** A machine of states: how many have begun, the state that it is in, and the one before; empty if it has ended. */
export type MachineState = {
  count: number;
  state: string;
  previous_state: string;
};

/** One reading, as a person sees it. */
export type Instrument = {
  name: string;
  title: string;
  labels: string[];
  units: string[];
  low: number | null;
  high: number | null;
  physical_unit: string;
  absent: string;
};

/** What pictures a camera can take, and how long one holds the line. */
export type CameraLimits = {
  zooms: number[] | null;
  capture: number;
  byte: number;
};

/** A line of the event log: its number, s on the panel's clock, a kind to filter by, and what happened. */
export type Line = {
  number: number;
  time: number;
  kind: "call" | "link" | "robot" | "state" | "note" | "panel" | "recorder" | "agent";
  text: string;
  bad: boolean;
};
