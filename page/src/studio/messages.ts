// What the studio's page may ask for beside what any page may, and what it is told.

/** What the page may ask for: the fields of each request. */
export type Asked = {
  /** Begin a program. */
  run_program: {
    text: string;
    name: string;
    robot?: string;
    speed?: number;
    breakpoints?: number[];
    lab?: string;
  };
  /** Interrupt the program. */
  stop_program: Record<string, never>;
  /** Let the program stand still at its next line. */
  pause_program: Record<string, never>;
  /** Let the paused program go on. */
  go_on: { how: "on" | "over" | "into" | "out" };
  /** Say where the program is to pause. */
  set_breakpoints: { lines: number[] };
  /** Say how fast the world goes; 0 for as fast as possible. */
  set_pace: { speed: number };
  /** Show the world of a robot, which nobody drives. */
  show_world: { robot: string };
  /** Ask for the labs. */
  labs: Record<string, never>;
  /** Judge a program. */
  check_lab: { lab: string; text: string };
  /** Take a lab from a zipped folder. */
  open_lab_folder: { zip: string };
};

/** What each request is answered with. */
export type Answered = {
  run_program: null;
  stop_program: null;
  pause_program: null;
  go_on: null;
  set_breakpoints: null;
  set_pace: null;
  show_world: null;
  labs: Lab[];
  check_lab: Report;
  open_lab_folder: Lab;
};

/** What the page is told without having asked. */
export type Told = Output | Program;

/** A lab: its instructions are Markdown. */
export type Lab = {
  name: string;
  title: string;
  summary: string;
  text: string;
  start: string;
  goals: LabGoal[];
};

/** A goal of a lab. */
export type LabGoal = {
  name: string;
  points: number;
  sentence: string;
};

/** What became of a check, and the text of the file to hand in. */
export type Report = {
  variants: Judged[];
  points: number;
  most: number;
  file: string;
};

/** One variant of a lab. */
export type Judged = {
  name: string;
  is_hidden: boolean;
  passed: boolean;
  goals: Goal[];
  ending: string;
  why: string;
  time: number;
};

/** Whether a goal is reached, and in words. */
export type Goal = {
  name: string;
  holds: boolean;
  text: string;
};

/** What the program printed. */
export type Output = {
  type: "output";
  text: string;
  is_error: boolean;
};

/** How the program stands. */
export type Program = {
  type: "program";
  state: "idle" | "running" | "paused";
  name: string;
  line: number | null;
  time: number;
  variables: Variable[];
  stack: Frame[];
  mistake: Mistake | null;
  goals: Goal[];
};

/** A variable of the program. */
export type Variable = {
  name: string;
  value: string;
  type: string;
};

/** A call that the program is in. */
export type Frame = {
  function: string;
  line: number;
};

/** Why the program ended. */
export type Mistake = {
  kind: string;
  message: string;
  hint: string;
  line: number | null;
  trace: string;
};
