// What the page may ask for and what it is told, from the classes of src/elib/panel. Generated; do not edit. Renew it:
// .venv/bin/python docs/generate_reference.py

/** What the page may ask for: the fields of each request. */
export type Asked = {
  /** Be told of something again and again; a rate of 0 ends it. */
  subscribe: {
    what: "robot" | "overview" | "world" | "readings" | "study";
    of?: string;
    rate?: number;
    rays?: boolean;
    channel?: number;
  };
  /** The page has drawn an update. */
  drawn: { number: number };
  /** The page has drawn a frame of the world. */
  frame_drawn: { number: number };
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
  /** Write a log; if the robot is not connected yet, from the moment it is. */
  start_log: { robot: string; name: string };
  /** Write the log no more. */
  stop_log: { robot: string };
  /** Record everything; if the robot is not connected yet, from the moment it is. */
  start_recording: { robot: string; name: string };
  /** Record no more. */
  stop_recording: { robot: string };
  /** Go on with a recording from another moment of it. */
  seek: { robot: string; seconds: number };
  /** Hold a recording, or let it go on. */
  pause_playback: { robot: string; on: boolean };
  /** Stop one robot, or all of them. */
  stop: { robot?: string };
  /** Start a behaviour on some robots. */
  behave: { robots: string[]; name: string; options?: Record<string, boolean | number | string> };
  /** Let the behaviour of some robots wait. */
  pause_behaviour: { robots: string[] };
  /** Let the behaviour of some robots go on. */
  resume_behaviour: { robots: string[] };
  /** End the behaviour of some robots. */
  end_behaviour: { robots: string[] };
  /** Ask for the source text of a behaviour. */
  source: { name: string };
  /** Ask which logs and recordings the folder has, and for free names of new ones. */
  files: Record<string, never>;
  /** Play a recording of the folder as a robot of the panel. */
  open_recording: { name: string };
  /** Let one of the best controllers of the study drive in the world; null for the newest at any time. */
  choose_controller: { number: number | null };
  /** Save the world that the page shows, as it is now, as a world file of the folder. */
  save_world: { name: string; about?: string };
  /** Control the world that the page shows: a message of the control server. */
  world: { message: Record<string, unknown> };
};

/** What each request is answered with. */
export type Answered = {
  subscribe: null;
  drawn: null;
  frame_drawn: null;
  find: Found[];
  recents: string[];
  forget: string[];
  add: string[];
  remove: null;
  connect: null;
  disconnect: null;
  steer: boolean;
  beat: boolean;
  leave: null;
  take_over: null;
  limit: null;
  command: string;
  console: ConsoleAnswer;
  complete: Completions;
  blink: null;
  set_camera: null;
  picture: null;
  live: null;
  start_log: null;
  stop_log: null;
  start_recording: null;
  stop_recording: null;
  seek: null;
  pause_playback: null;
  stop: null;
  behave: null;
  pause_behaviour: null;
  resume_behaviour: null;
  end_behaviour: null;
  source: string;
  files: FileList;
  open_recording: string[];
  choose_controller: null;
  save_world: SavedWorld;
  world: Record<string, unknown>;
};

/** What the page is told without having asked. */
export type Told = Hello | Update | NewScene | Change | Readings | Answer | Failure | Error;

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

/** The file of a world, and the URL that opens it. */
export type SavedWorld = {
  name: string;
  url: string;
};

/** What a page is told once: its name at the drive locks, and the folder of files, empty if it may not know it. */
export type Hello = {
  type: "hello";
  page: string;
  can: Can;
  folder: string;
  worlds: WorldInfo[];
  behaviours: BehaviourAbout[];
  kinds: Record<string, string>;
  ring: Ring;
  addresses: Address[];
  study: StudyAbout | null;
};

/** What has changed since the last update; a page says ``drawn`` with its number. */
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

/** The world that the page shows from now on, or that it shows none. */
export type NewScene = {
  type: "scene";
  channel: number;
  scene: Scene | null;
};

/** What stands elsewhere or shines otherwise than before, each with its index; or all of a kind. */
export type Change = {
  type: "change";
  channel: number;
  walls?: [number, number, number, number, string, number][];
  all_boxes?: Box[];
  boxes?: [number, number, number, number][];
  cylinders?: [number, number, number][];
  lights?: [number, Light][];
  sounds?: [number, Sound][];
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

/** What the page may do. */
export type Can = {
  drive: boolean;
  edit: boolean;
  speed: boolean;
  save: boolean;
  connect: boolean;
  files: boolean;
  program: boolean;
};

/** Where a program reaches a robot. */
export type Address = {
  name: string;
  url: string;
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

/** Where on the robot the infrared sensors look and the LEDs sit, rad from straight ahead, positive to the left. */
export type Ring = {
  sensors: number[];
  leds: number[];
};

/** A study: its task, how many generations it is to have, and s that a robot has. */
export type StudyAbout = {
  task: string;
  summary: string;
  count: number;
  seconds: number;
  settings: Record<string, string>;
};

/** A robot of the panel: its key, its name as a tab shows it, and its URL. */
export type Listed = {
  key: string;
  label: string;
  url: string;
};

/** What is new of the robot that the page shows. */
export type RobotNews = {
  tick: Tick;
  behaviour: Play;
  scheme?: Scheme;
};

/** The part of a tick that an overview of many robots draws. */
export type Summary = {
  url: string;
  phase: "disconnected" | "connecting" | "connected" | "gap" | "playing" | "failed";
  phase_text: string;
  error: string | null;
  may_move: boolean;
  driver: string;
  behaviour: string;
  pose: [number, number, number] | null;
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
  walls: [number, number, number, number, string, number][];
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
};

/** A box: m, rad, and whether it gives way to a robot. */
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
};

/** A lamp that shines on all sides. */
export type Light = {
  x: number;
  y: number;
  height: number;
  intensity: number;
  name: string;
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
  phase: "disconnected" | "connecting" | "connected" | "gap" | "playing" | "failed";
  phase_text: string;
  error: Trouble | null;
  doctor: Doctor | null;
  drive: Drive;
  readings: Record<string, Reading>;
  lamps: Lamps;
  camera: CameraSettings | null;
  picture: Picture | null;
  distances: (number | null)[];
  pose: [number, number, number] | null;
  trail: Trail;
  lines: Lines;
  link: LinkStats | null;
  log: string | null;
  recorder: RecorderState | null;
  playback: Playing | null;
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

/** What seldom changes of a robot: rev/s of its fastest wheel, m around a wheel, the LED that the firmware keeps. */
export type Scheme = {
  scheme: number;
  firmware: string;
  fastest: number;
  circumference: number;
  status_led: number | null;
  instruments: Instrument[];
};

/** The painted floor, if there is a picture of it; without a colour, it is bare linoleum. */
export type Floor = {
  colour: string | null;
  picture: boolean;
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

/** What the doctor found. */
export type Doctor = {
  steps: DiagnosedStep[];
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

/** The recording that is written. */
export type RecorderState = {
  path: string;
  bytes: number;
  messages: number;
};

/** How far a recording was played, s. */
export type Playing = {
  at: number;
  length: number;
  paused: boolean;
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

/** What the doctor found in one step, and what to do. */
export type DiagnosedStep = {
  name: string;
  state: "failed" | "ok" | "skipped" | "warning";
  detail: string;
  fix: string;
};

/** A line of the event log: its number, s on the panel's clock, a kind as the page filters by, and what happened. */
export type Line = {
  number: number;
  time: number;
  kind: string;
  text: string;
  bad: boolean;
};

export type Walls = [number, number, number, number, string, number][];
