// What the page may ask for and what it is told, by the classes of elib. Do not edit; renew it with:
// .venv/bin/python docs/generate_reference.py

/** What the page may ask for: the fields of each request. */
export type Asked = {
  /** Begin to run a program, on the robot of a URL if there is one, at a speed; 0 is as fast as possible. */
  run_program: {
    text: string;
    name: string;
    imported: Record<string, string>;
    robot: string;
    speed: number;
    breakpoints: number[];
    lab?: string;
  };
  /** End the program, as Ctrl-C does. */
  stop_program: Record<string, never>;
  /** Let the program and its robots stand still. */
  pause_program: Record<string, never>;
  /** Let a program that stands still go on: to its next breakpoint, or by a step. */
  go_on: { how: "into" | "on" | "out" | "over" };
  /** Let the program stand still before these lines. */
  set_breakpoints: { lines: number[] };
  /** Let the robots of the program live so many times faster than the clock; 0 is as fast as possible. */
  set_pace: { speed: number };
  /** Show the world of a virtual robot, or of a lab, before a program runs in it. */
  show_world: { robot: string; lab?: string };
  /** Tell of all labs. */
  labs: Record<string, never>;
  /** Run a program in all variants of a lab, hidden ones too, and tell what became of it. */
  check_lab: { lab: string; text: string };
  /** Take a lab from a zipped folder, as base64. */
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
  labs: LabNews[];
  check_lab: Report;
  open_lab_folder: LabNews;
};

/** What the page is told without having asked. */
export type Told = Output | ProgramNews;

/** A lab: its instructions are Markdown. */
export type LabNews = {
  name: string;
  title: string;
  summary: string;
  text: string;
  start: string;
  goals: LabGoal[];
};

/** What became of a check, and the text of the file to hand in. */
export type Report = {
  variants: Judged[];
  points: number;
  most: number;
  file: string;
};

/** What the program has printed. */
export type Output = {
  type: "output";
  text: string;
  is_error: boolean;
};

/** What the program does. */
export type ProgramNews = {
  type: "program";
  state: "idle" | "paused" | "running";
  name: string;
  line: number | null;
  time: number;
  variables: Variable[];
  stack: Called[];
  mistake: Mistake | null;
  goals: GoalNews[];
};

/** A goal of a lab. */
export type LabGoal = {
  name: string;
  points: number;
  sentence: string;
};

/** One variant of a lab. */
export type Judged = {
  name: string;
  is_hidden: boolean;
  passed: boolean;
  goals: GoalNews[];
  ending: string;
  why: string;
  time: number;
};

/** A variable of the program: its value as text, and its type. */
export type Variable = {
  name: string;
  value: string;
  type: string;
};

/** A function of the program that has been called and goes on, and its line. */
export type Called = {
  function: string;
  line: number;
};

/** Why a program ended: name, text and hint of the error, its line in the program, and the whole traceback. */
export type Mistake = {
  kind: string;
  message: string;
  hint: string;
  line: number | null;
  trace: string;
};

/** Whether a goal is reached, and in words. */
export type GoalNews = {
  name: string;
  holds: boolean;
  text: string;
};
