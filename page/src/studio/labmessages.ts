// What the page may ask of labs: until Python knows them, nobody answers.
import type { ProgramNews } from "./messages";

export type Asked = {
  labs: Record<string, never>;
  check_lab: { lab: string; text: string };
  open_lab_folder: { zip: string };
};
export type Answered = { labs: Lab[]; check_lab: Report; open_lab_folder: Lab };
export type News = ProgramNews & { goals?: Goal[] };

export type Lab = {
  name: string;
  title: string;
  summary: string;
  text: string; // Markdown
  start: string;
  goals: { name: string; points: number; sentence: string }[];
};
export type Goal = { name: string; holds: boolean; text: string };
export type Judged = {
  name: string;
  is_hidden: boolean;
  passed: boolean;
  goals: Goal[];
  ending: string;
  why: string;
  time: number;
};
export type Report = { variants: Judged[]; points: number; most: number; file: string };
