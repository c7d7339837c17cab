// Labs: what is to be done, which goals the program reaches while it runs, and what a check says of it.
import { effect, signal } from "@preact/signals";
import * as icons from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Icon } from "../look/Icon";
import { Markdown } from "../look/Markdown";
import { number, save } from "../look/text";
import { ask, toast } from "../store";
import type { Judged, LabNews } from "./messages";
import * as programs from "./programs";
import { lab } from "./programs";
import { clear, here, isIdle, report } from "./run";
import { loading, zippedLabs } from "./wire";

const ELSEWHERE = /^## Begin\n[^]*?(?=^## )/m; // what to type where elib is installed
const POINTS = "elib-points:"; // of the best check of a lab, in this browser's storage

export const hasLabs = signal(false);
const labs = signal<LabNews[]>([]);

const bestOf = ({ name }: LabNews) => Number(localStorage.getItem(POINTS + name));
const mostOf = ({ goals }: LabNews) => goals.reduce((sum, { points }) => sum + points, 0);

const choose = (chosen: LabNews) => programs.open(`${chosen.name}.py`, chosen.start, "Where the lab begins", chosen);

async function openFolder(file: Blob) {
  const zip = new Uint8Array(await file.arrayBuffer()).toBase64(),
    found = await ask("open_lab_folder", { zip });
  if (!found) return;
  zippedLabs.set(found.name, zip);
  labs.value = [...labs.value.filter((each) => each.name !== found.name), found];
  choose(found);
}

const beside = new URLSearchParams(location.search).get("lab"); // a lab folder that lies in the folder of the page
const hasOpened = effect(() => {
  if (!beside || loading.value) return;
  hasLabs.value = true;
  fetch(beside)
    .then((found) => (found.ok ? found.blob() : Promise.reject(new Error(found.statusText))))
    .then(openFolder)
    .catch(({ message }) => toast(`There is no lab at ${beside}: ${message}`));
  queueMicrotask(() => hasOpened()); // once, and not again with another Python
});

function Choice() {
  const file = useRef<HTMLInputElement>(null),
    isReady = !loading.value,
    take = (files: FileList | null | undefined) => files?.[0] && openFolder(files[0]);
  useEffect(() => {
    if (isReady) ask("labs", {}).then((found) => (labs.value = found ?? []));
  }, [isReady]);
  return (
    <div
      class="stack"
      onDragOver={(event) => event.preventDefault()}
      onDrop={(event) => (event.preventDefault(), take(event.dataTransfer?.files))}
    >
      <h2>Labs</h2>
      {!isReady && <p class="hint">They come when Python is loaded.</p>}
      <ul class="list">
        {labs.value.map((each, k) => (
          <li key={each.name}>
            <Button
              weight="quiet"
              disabled={!!each.missing}
              act={() => choose(each)}
              children={`${k + 1}. ${each.title}`}
            />
            <p class="hint">{each.missing || each.summary}</p>
            {bestOf(each) > 0 && <p class="good">Best check: {pointsOf(bestOf(each), mostOf(each))}</p>}
          </li>
        ))}
      </ul>
      <Button icon={icons.FolderOpen} disabled={!isReady} act={() => file.current!.click()}>
        Open a lab folder (.zip)
      </Button>
      <input
        {...({ ref: file, type: "file", hidden: true, accept: ".zip" } as const)}
        onChange={({ currentTarget }) => take(currentTarget.files)}
      />
    </div>
  );
}

const Mark = ({ is, no = icons.Circle }: { is: boolean; no?: icons.IconNode }) => (
  <Icon of={is ? icons.Check : no} size={16} />
);

const pointsOf = (points: number, most: number) => `${number(points)} of ${number(most)} points`;

const NUMBERS = /[−-]?\d+(\.\d+)?/g;

/** What went wrong in a variant. */
const wrongIn = ({ why, goals }: Judged) => [why, ...goals.flatMap(({ holds, text }) => (holds ? [] : text))];

/** One variant, and what went wrong there if not only its numbers differ from the variant before it. */
function Variant({ of, before }: { of: Judged; before?: Judged }) {
  const { name, passed, time } = of,
    texts = wrongIn(of),
    unnumbered = (texts: string[]) => texts.join().replace(NUMBERS, ""),
    isSame = !passed && before && unnumbered(texts) === unnumbered(wrongIn(before));
  return (
    <li>
      <p class={`row ${passed ? "good" : "bad"}`}>
        <Mark is={passed} no={icons.X} />
        <b class="fill">{name === "given" ? "as in the task" : name}</b>
        <span class="small">{`${passed ? "reached all" : isSame ? "missed the same" : "missed"}, ${number(time, 1)} s`}</span>
      </p>
      {!isSame && texts.map((text) => text && <p>{text}</p>)}
    </li>
  );
}

function Chosen({ chosen }: { chosen: LabNews }) {
  const { variants, file } = report.value ?? { variants: [], file: "" },
    runs = variants.length ? variants : [here.value],
    hasReached = (wanted: string) =>
      runs.every(({ goals }) => goals.some(({ name, holds }) => name === wanted && holds)),
    [task, ...more] = chosen.text
      .replace(ELSEWHERE, "")
      .replaceAll("`start.py`", "the program")
      .split(/^(?=Why: |## )/m),
    resultName = programs.name.value.replace(/(\.py)?$/, "-result.json");
  const check = async () => {
    programs.save(true);
    clear();
    const found = await ask("check_lab", { lab: chosen.name, text: programs.textNow() });
    if (!found || lab.value !== chosen) return;
    report.value = found;
    localStorage.setItem(POINTS + chosen.name, `${Math.max(found.points, bestOf(chosen))}`);
  };
  return (
    <div class="stack">
      <div class="row">
        <Button weight="quiet" icon={icons.ArrowLeft} label="All labs" act={() => (lab.value = null)} />
        <h2 class="fill">{chosen.title}</h2>
        <Button
          {...({ weight: "quiet", icon: icons.RotateCcw, label: "Begin again; your program is kept" } as const)}
          act={() => programs.borrow(`${chosen.name}.py`, chosen.start, "Where the lab begins", chosen)}
        />
      </div>
      <Markdown text={task} />
      <ul class="goals list" aria-label="goals">
        {chosen.goals.map(({ name, sentence }) => (
          <li key={name} class={`row ${hasReached(name) ? "good" : ""}`}>
            <Mark is={hasReached(name)} />
            <span class="fill">{sentence}</span>
            {hasReached(name) && <span class="small">reached</span>}
          </li>
        ))}
      </ul>
      <div class="row wrap">
        <Button weight="primary" icon={icons.ClipboardCheck} disabled={!isIdle() || loading.value !== ""} act={check}>
          Check
        </Button>
        {report.value && <b role="status">{pointsOf(report.value.points, report.value.most)}</b>}
        {report.value && (
          <Button icon={icons.Download} act={() => save(new Blob([file]), resultName)} children="Save result file" />
        )}
      </div>
      <ul class="list">
        {variants.map((each, k) => (
          <Variant key={each.name} of={each} before={variants[k - 1]} />
        ))}
      </ul>
      <Markdown text={more.join("")} />
    </div>
  );
}

export const Labs = () => (
  <aside class="labs card" key={lab.value?.name} aria-label="labs">
    {lab.value ? <Chosen key={lab.value.name} chosen={lab.value} /> : <Choice />}
  </aside>
);
