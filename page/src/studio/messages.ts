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
  /** Return the state machine of a program; *places* says where a hand has put states. */
  read_states: { text: string; places: Record<string, [number, number]> };
  /** Return what the forms of a picture offer. */
  state_forms: Record<string, never>;
  /** Add a state that stops the robot when it is entered. */
  add_state: { text: string; name: string };
  /** Give a state another name, in its function and wherever the machine names it. */
  rename_state: { text: string; state: string; name: string };
  /** Remove a state with its function, and the arrows that lead to it. */
  remove_state: { text: string; state: string };
  /** Let the machine begin in another state. */
  set_start: { text: string; state: string };
  /** Add an arrow behind the other arrows of a state; without a condition it is always taken. */
  add_arrow: { text: string; source: string; target: string; condition: Condition | string };
  /** Let an arrow lead to another state. Arrows are counted from 0, in the order of states and text. */
  retarget: { text: string; arrow: number; target: string };
  /** Give an arrow another condition, or one of those that must all hold; one more if it does not have that *part*. */
  set_condition: { text: string; arrow: number; condition: Condition | string; part?: number };
  /** Remove an arrow, and the reading that only it needs. */
  remove_arrow: { text: string; arrow: number };
  /** Add a command to what a state does: in each step, or only when it is entered. */
  add_action: {
    text: string;
    state: string;
    command: string;
    arguments: Record<string, string>;
    on_entry: boolean;
  };
  /** Change some arguments of a command of a state. Its statements are counted from 0. */
  set_action: { text: string; state: string; item: number; arguments: Record<string, string> };
  /** Remove a statement of a state, but no reading that another one needs. They are counted from 0. */
  remove_item: { text: string; state: string; item: number };
};

/** What requests are answered with; all others with null. */
export type Answered = {
  labs: LabNews[];
  check_lab: Report;
  open_lab_folder: LabNews;
  read_states: MachineNews;
  state_forms: Forms;
  add_state: Splice[];
  rename_state: Splice[];
  remove_state: Splice[];
  set_start: Splice[];
  add_arrow: Splice[];
  retarget: Splice[];
  set_condition: Splice[];
  remove_arrow: Splice[];
  add_action: Splice[];
  set_action: Splice[];
  remove_item: Splice[];
};

/** What the page is told without having asked. */
export type Told = Output | ProgramNews;

/** A condition as a form gives it. */
export type Condition = {
  reading: string;
  path: string;
  comparison: "!=" | "<" | "<=" | "==" | ">" | ">=" | "not seen" | "seen";
  value: string;
};

/** A lab: its instructions are Markdown; *missing* says why its program cannot run here, if it cannot. */
export type LabNews = {
  name: string;
  title: string;
  summary: string;
  text: string;
  start: string;
  goals: LabGoal[];
  missing: string;
};

/** What became of a check, and the text of the file to hand in. */
export type Report = {
  variants: Judged[];
  points: number;
  most: number;
  file: string;
};

/** The state machine of a program: an SVG document, and what it shows. */
export type MachineNews = {
  svg: string;
  start: string;
  states: StateNews[];
  arrows: ArrowNews[];
  problems: string[];
};

/** All that the forms of a picture offer. */
export type Forms = {
  readings: ReadingForm[];
  actions: ActionForm[];
};

/** A text that takes the place of what stands from one position to another. */
export type Splice = {
  begin: number;
  end: number;
  text: string;
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
  states: [string, string];
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

/** A state: what it says of itself, where it begins, and its statements; none if it is made elsewhere. */
export type StateNews = {
  name: string;
  about: string;
  line: number;
  items: ItemNews[];
};

/** An arrow: in words when it is taken, the conditions that must all hold, and whether the picture can change it. */
export type ArrowNews = {
  source: string;
  target: string;
  words: string;
  parts: PartNews[];
  is_plain: boolean;
  line: number;
};

/** A reading that conditions may compare: its method, its words and its numbers. */
export type ReadingForm = {
  name: string;
  title: string;
  fields: ReadingField[];
};

/** A command that a state may give: its method, a sentence, and its arguments. */
export type ActionForm = {
  name: string;
  about: string;
  arguments: ArgumentForm[];
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

/** A statement of a state: its text, and of a command its name and the arguments as they are written. */
export type ItemNews = {
  kind: "action" | "arrow" | "code" | "look";
  text: string;
  line: number;
  on_entry: boolean;
  command: string;
  arguments: Record<string, string>;
};

/** A condition of an arrow: in Python, and as a form gives it if one can. */
export type PartNews = {
  test: string;
  condition: Condition | null;
};

/** A number of a reading: its words, how Python reads it from the reading, and its unit as a person is told it. */
export type ReadingField = {
  label: string;
  path: string;
  unit: string;
  scale: number;
};

/** An argument of a command: what it may be, its value in the example, and what it can be chosen from if anything. */
export type ArgumentForm = {
  name: string;
  rule: string;
  value: string;
  choices: string[];
  unit: string;
  scale: number;
};
