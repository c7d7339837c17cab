// The state machine of the program as a picture: what runs is lit, and what a hand does changes the text.
import * as icons from "lucide";
import { Button } from "../look/Button";
import { Machine } from "../robot/Machine";
import { undoInText } from "./editor";
import { ArrowForm, StateForm } from "./StateForms";
import { chosen, drawnFrom, edit, isBehind, isOpen, layOut, machine, put, trouble, type Chosen } from "./machine";
import { beginMachine } from "./programs";
import { here } from "./run";
import "./states.css";

const AFTER_A_SECOND = { reading: "", path: ".time_in_state", comparison: ">", value: "1" } as const;
const MOTIONS = ["drive", "turn", "go_to"]; // after which a state has done what it is for
const MOVED = 4; // pixels that a press moves until it drags

const keyOf = (it: Chosen) => (!it ? "" : "state" in it ? `[data-state="${it.state}"]` : `[data-arrow="${it.arrow}"]`);
const named = (target: EventTarget | null) =>
  (target as Element | null)?.closest<SVGGElement>("[data-state], [data-arrow]");

function chosenBy(element: SVGGElement): Chosen {
  const { state, arrow } = element.dataset;
  return state ? { state } : { arrow: Number(arrow) };
}

/** Choose what was pressed; while an arrow is drawn, a state is where it leads. */
async function press(element: SVGGElement | null | undefined) {
  const source = drawnFrom.value,
    target = element?.dataset.state;
  drawnFrom.value = "";
  if (source && target) {
    const { states, arrows } = machine.value!,
      moves = states.find(({ name }) => name === source)!.items.some(({ command }) => MOTIONS.includes(command)),
      isFirst = arrows.every((each) => each.source !== source);
    if (await edit("add_arrow", { source, target, condition: moves && isFirst ? "" : AFTER_A_SECOND }))
      // It stands behind the other arrows of its state, or before a last return, which may lead to the same state.
      chosen.value = {
        arrow: machine.value!.arrows.findIndex(
          ({ source: from, target: to, words }, k) =>
            from === source && to === target && !(arrows[k]?.source === source && arrows[k].words === words),
        ),
      };
  } else chosen.value = element && target !== "end" ? chosenBy(element) : null;
}

export async function remove() {
  const it = chosen.value;
  if (!it) return;
  if ("state" in it ? await edit("remove_state", it) : await edit("remove_arrow", it)) chosen.value = null;
}

async function addState() {
  const taken = new Set(machine.value!.states.map(({ name }) => name));
  let number = taken.size + 1;
  while (taken.has(`state_${number}`)) number++;
  const name = `state_${number}`;
  if (await edit("add_state", { name })) chosen.value = { state: name };
}

function onKey(event: KeyboardEvent) {
  const element = named(event.target);
  if ((event.ctrlKey || event.metaKey) && event.key === "z") undoInText();
  else if (event.key === "Enter" || event.key === " ") press(element);
  else if (event.key === "Delete" && element) ((chosen.value = chosenBy(element)), remove());
  else if (event.key === "Escape" && drawnFrom.value) drawnFrom.value = "";
  else return;
  event.preventDefault();
  event.stopPropagation();
}

/** Let a state follow the pointer until it is released, and stay there. */
function drag(event: PointerEvent, box: HTMLElement) {
  const element = named(event.target),
    { state } = element?.dataset ?? {},
    svg = box.querySelector("svg");
  if (!element || !state || !svg || drawnFrom.value) return;
  const { clientX, clientY } = event,
    scale = svg.viewBox.baseVal.width / svg.getBoundingClientRect().width,
    rect = element.querySelector<SVGGraphicsElement>("rect, circle")!.getBBox();
  const by = (moved: PointerEvent) => [(moved.clientX - clientX) * scale, (moved.clientY - clientY) * scale] as const;
  const move = (moved: PointerEvent) => {
    const [x, y] = by(moved);
    if (Math.hypot(x, y) > MOVED) element.setAttribute("transform", `translate(${x} ${y})`);
  };
  const drop = (moved: PointerEvent) => {
    const [x, y] = by(moved);
    removeEventListener("pointermove", move);
    if (Math.hypot(x, y) > MOVED) put(state, [rect.x + rect.width / 2 + x, rect.y + rect.height / 2 + y]);
  };
  addEventListener("pointermove", move);
  addEventListener("pointerup", drop, { once: true });
}

function Picture() {
  const { svg } = machine.value!,
    { states, state } = here.value;
  return (
    <Machine
      {...{ svg, states: state === "idle" ? ["", ""] : states, chosen: keyOf(chosen.value), onKeyDown: onKey }}
      onClick={(event) => press(named(event.target))}
      onPointerDown={(event) => drag(event, event.currentTarget)}
    />
  );
}

export function States() {
  const found = machine.value,
    it = chosen.value,
    source = it && "state" in it ? it.state : "",
    said = drawnFrom.value
      ? `Click the state that the arrow from ${drawnFrom.value} leads to`
      : trouble.value || found?.problems[0] || "Click a state or an arrow; drag a state to move it";
  if (!isOpen.value) return null;
  return (
    <div class="states well" data-writes="" aria-busy={isBehind.value}>
      <div class="row wrap" role="toolbar" aria-label="states">
        <Button icon={icons.Plus} disabled={!found || !!trouble.value} act={addState} children="State" />
        <Button
          {...{ icon: icons.MoveRight, disabled: !source || !!trouble.value, children: "Arrow" }}
          act={() => (drawnFrom.value = source)}
        />
        <Button icon={icons.Trash2} disabled={!it} act={remove} children="Delete" />
        <Button icon={icons.Undo2} act={undoInText} label="Undo" weight="quiet" />
        <Button icon={icons.Network} act={layOut} label="Tidy up: put the states in their places" weight="quiet" />
        <p class={`hint fill ${trouble.value && !drawnFrom.value ? "bad" : ""}`} role="status" children={said} />
      </div>
      <div class="row both">
        {found ? <Picture /> : <Button icon={icons.Workflow} act={beginMachine} children="Begin a machine of states" />}
        {found && it && ("state" in it ? <StateForm key={it.state} {...it} /> : <ArrowForm key={it.arrow} {...it} />)}
      </div>
    </div>
  );
}
