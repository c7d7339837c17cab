// Labs: what is to be done, which goals the program reaches while it runs, and what a check says of it.
import { signal } from "@preact/signals";
import { ArrowLeft, Check, Circle, ClipboardCheck, Download, FolderOpen, RotateCcw, X } from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { Icon } from "../look/Icon";
import { number, save } from "../look/text";
import { Markdown } from "./Markdown";
import type { Judged, Lab, Report } from "./messages";
import { borrow, name, open, save as keep, textNow } from "./programs";
import { ask, lab, program } from "./run";
import { loading } from "./wire";

export const isOpen = signal(false);
const labs = signal<Lab[]>([]);
const report = signal<Report | null>(null);
const ELSEWHERE = /^## Begin\n[^]*?(?=^## )/m; // what to type where elib is installed

function choose(chosen: Lab) {
  lab.value = chosen;
  report.value = null;
  open(`${chosen.name}.py`, chosen.start, `Where the lab begins: ${chosen.title}`);
}

async function openFolder(file: File) {
  const bytes = new Uint8Array(await file.arrayBuffer()),
    zip = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join("")),
    found = await ask("open_lab_folder", { zip });
  if (!found) return;
  labs.value = [...labs.value.filter((each) => each.name !== found.name), found];
  choose(found);
}

function Choice() {
  const file = useRef<HTMLInputElement>(null);
  const take = (files?: FileList | null) => files?.[0] && openFolder(files[0]);
  useEffect(() => {
    if (!loading.value && !labs.value.length) ask("labs", {}).then((found) => (labs.value = found ?? []));
  }, [loading.value]);
  return (
    <div
      class="stack"
      onDragOver={(event) => event.preventDefault()}
      onDrop={(event) => (event.preventDefault(), take(event.dataTransfer?.files))}
    >
      <h2>Labs</h2>
      {!labs.value.length && <p class="hint">The labs come when Python is loaded.</p>}
      <ul class="list">
        {labs.value.map((each) => (
          <li key={each.name}>
            <Button weight="quiet" act={() => choose(each)}>
              {each.title}
            </Button>
            <p class="hint">{each.summary}</p>
          </li>
        ))}
      </ul>
      <Button icon={FolderOpen} disabled={Boolean(loading.value)} act={() => file.current!.click()}>
        Open a lab folder (.zip)
      </Button>
      <input
        ref={file}
        {...({ type: "file", hidden: true, accept: ".zip" } as const)}
        onChange={({ currentTarget }) => take(currentTarget.files)}
      />
    </div>
  );
}

const Goal = ({ holds, children }: { holds: boolean; children: preact.ComponentChildren }) => (
  <li class={`row ${holds ? "good" : ""}`}>
    <Icon of={holds ? Check : Circle} size={16} />
    <span class="fill">{children}</span>
    {holds && <span class="small">reached</span>}
  </li>
);

/** One variant: a hidden one says nothing but whether the program passes. */
const Variant = ({ name, is_hidden, passed, goals, ending, why, time }: Judged) => (
  <li>
    <p class={`row ${passed ? "good" : "bad"}`}>
      <Icon of={passed ? Check : X} size={16} />
      <b class="fill">{name}</b>
      <span class="small">{`${passed ? "passes" : "does not pass"}, ${ending || "ended"} after ${number(time, 1)} s`}</span>
    </p>
    {!passed && why && <p>{why}</p>}
    {!passed && !is_hidden && goals.map((each) => <p class={each.holds ? "hint" : "warn"}>{each.text}</p>)}
  </li>
);

function Chosen({ chosen }: { chosen: Lab }) {
  const told = program.value.goals,
    found = report.value;
  const check = async () => {
    keep(true);
    report.value = null;
    report.value = (await ask("check_lab", { lab: chosen.name, text: textNow() })) ?? null;
  };
  return (
    <div class="stack">
      <div class="row">
        <Button weight="quiet" icon={ArrowLeft} label="All labs" act={() => (lab.value = null)} />
        <h2 class="fill">{chosen.title}</h2>
        <Button
          weight="quiet"
          icon={RotateCcw}
          label="Begin again: opens the first program, and yours is kept"
          act={() => borrow(`${chosen.name}.py`, chosen.start, "Where the lab begins")}
        />
      </div>
      <ul class="goals list" aria-label="goals">
        {chosen.goals.map((goal) => (
          <Goal key={goal.name} holds={told.find((each) => each.name === goal.name)?.holds ?? false}>
            {goal.sentence}
          </Goal>
        ))}
      </ul>
      <div class="row wrap">
        <Button
          weight="primary"
          icon={ClipboardCheck}
          disabled={program.value.state !== "idle" || Boolean(loading.value)}
          act={check}
        >
          Check
        </Button>
        {found && (
          <>
            <b role="status" class={found.points === found.most ? "good" : ""}>
              {number(found.points)} of {number(found.most)} points
            </b>
            <Button
              icon={Download}
              act={() => save(new Blob([found.file]), name.value.replace(/(\.py)?$/, "-result.json"))}
            >
              Save result file
            </Button>
          </>
        )}
      </div>
      {found && (
        <ul class="list">
          {found.variants.map((each) => (
            <Variant key={each.name} {...each} />
          ))}
        </ul>
      )}
      <Markdown text={chosen.text.replace(ELSEWHERE, "")} />
    </div>
  );
}

export const Labs = () => (
  <aside class="labs card" aria-label="labs">
    {lab.value ? <Chosen chosen={lab.value} /> : <Choice />}
  </aside>
);
