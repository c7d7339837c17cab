// What the page may ask of labs: until Python knows them, nobody answers.
import type { ProgramNews } from "./messages";

export type Asked = {
  labs: Record<string, never>;
  check_lab: { lab: string; text: string };
  open_lab_folder: { zip: string };
};
export type Answered = { labs: LabNews[]; check_lab: Report; open_lab_folder: LabNews };
export type News = ProgramNews & { goals?: GoalNews[] };

export type LabNews = {
  name: string;
  title: string;
  summary: string;
  text: string; // Markdown
  start: string;
  goals: { name: string; points: number; sentence: string }[];
};
export type GoalNews = { name: string; holds: boolean; text: string };
export type Judged = {
  name: string;
  is_hidden: boolean;
  passed: boolean;
  goals: GoalNews[];
  ending: string;
  why: string;
  time: number;
};
export type Report = { variants: Judged[]; points: number; most: number; file: string };
