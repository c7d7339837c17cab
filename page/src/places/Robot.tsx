// The page of one robot. What one does most is largest: its world (or its path), the pad and the camera are always in
// view, and beside them stands one instrument in full height. On a phone the pad stays under the thumbs, and the place
// above it shows the world, the camera, or an instrument.
import { useEffect, useRef } from "preact/hooks";
import {
  Camera as CameraIcon,
  ChartLine,
  FileText,
  Gauge,
  Lightbulb,
  List,
  Map as MapIcon,
  Radio,
  Sparkles,
  Terminal,
  Workflow,
  type IconNode,
} from "lucide";
import { Icon } from "../look/Icon";
import { isPhone } from "../look/screen";
import { address, place } from "../route";
import type { Can } from "../messages";
import { can, robotOf, subscribe, worldOf, type Robot as Model } from "../store";
import { Behaviours } from "../robot/Behaviours";
import { Camera } from "../robot/Camera";
import { Charts } from "../robot/Charts";
import { Console } from "../robot/Console";
import { Events } from "../robot/Events";
import { Files } from "../robot/Files";
import { Lights } from "../robot/Lights";
import { Link } from "../robot/Link";
import { Pad } from "../robot/Pad";
import { Sensors } from "../robot/Sensors";
import { Stage } from "../robot/Stage";
import { States } from "../robot/States";
import { isOff, Status } from "../robot/Status";
import { Trouble } from "../robot/Trouble";
import "../robot/robot.css";
import "./Robot.css";

type Kind = (props: { robot: Model }) => preact.ComponentChild;
type Instrument = {
  name: string;
  title: string;
  icon: IconNode;
  Kind: Kind;
  needs?: keyof Can;
  isFor?: (robot: Model) => boolean;
};

/** The instruments, one of which is open. On a phone the world and the camera take their turn among them. */
const INSTRUMENTS: Instrument[] = [
  { name: "sensors", title: "Sensors", icon: Gauge, Kind: Sensors },
  { name: "charts", title: "Charts", icon: ChartLine, Kind: Charts },
  { name: "behaviours", title: "Behaviours", icon: Sparkles, Kind: Behaviours, needs: "program" },
  {
    name: "states",
    title: "States",
    icon: Workflow,
    Kind: States,
    isFor: (robot) => Boolean(robot.tick.value?.machine),
  },
  { name: "lights", title: "Lights and sounds", icon: Lightbulb, Kind: Lights, needs: "drive" },
  { name: "console", title: "Console", icon: Terminal, Kind: Console, needs: "drive" },
  { name: "events", title: "Events", icon: List, Kind: Events },
  { name: "link", title: "Link", icon: Radio, Kind: Link },
  { name: "files", title: "Files", icon: FileText, Kind: Files, needs: "files" },
];
const VIEWS = [
  { name: "world", title: "World", icon: MapIcon },
  { name: "camera", title: "Camera", icon: CameraIcon },
];
export function Robot({ id }: { id: string }) {
  const robot = robotOf(id);
  const rail = useRef<HTMLElement>(null);
  useEffect(() => subscribe({ what: "robot", of: id, rate: 10 }), [id]);
  useEffect(() => {
    rail.current?.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest", inline: "center" });
  }, [place.value.part]);
  const instruments = INSTRUMENTS.filter(({ needs, isFor }) => (!needs || can()[needs]) && (isFor?.(robot) ?? true)),
    tabs = isPhone() ? [...VIEWS, ...instruments] : instruments,
    chosen = tabs.find(({ name }) => name === place.value.part) ?? tabs[0],
    open = instruments.find((each) => each === chosen),
    isThere = !isOff(robot),
    isPlayed = robot.tick.value?.phase === "playing", // nobody can drive it, and it may hold no picture
    { of, scene } = worldOf(),
    wasSeen = of === id && scene.value !== null && !robot.tick.value?.error, // a world outlives the link
    shows = (view: string) => !isPhone() || chosen.name === view;
  return (
    <div class="robot-place" data-there={isThere ? "yes" : "no"}>
      <section class="status" aria-label="connection">
        <Status robot={robot} />
      </section>
      {shows("world") && (
        <section class="card stage" aria-label="world">
          {isThere || wasSeen ? <Stage robot={robot} /> : <Trouble robot={robot} />}
        </section>
      )}
      {isThere && shows("camera") && (isPhone() || !isPlayed || robot.pixels.value) && (
        <section class="card camera-card" aria-label="camera">
          <Camera robot={robot} />
        </section>
      )}
      {isThere && !isPlayed && (
        <section class="card pad-card" aria-label="drive">
          <Pad robot={robot} />
        </section>
      )}
      <nav class="rail scrolls" ref={rail} role="tablist" aria-label="parts of the page" aria-orientation="vertical">
        {tabs.map(({ name, title, icon }) => (
          <a
            key={name}
            class="button tab"
            role="tab"
            href={address(id, name)}
            aria-selected={name === chosen.name}
            aria-controls="instrument"
          >
            <Icon of={icon} size={20} />
            <span>{title}</span>
          </a>
        ))}
      </nav>
      {open && (
        <section class="card stack instrument" id="instrument" role="tabpanel" aria-label={open.title}>
          {!isPhone() && <h2>{open.title}</h2>}
          <open.Kind key={open.name} robot={robot} />
        </section>
      )}
    </div>
  );
}
