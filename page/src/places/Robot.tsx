// The page of one robot. What one does most is largest: its world (or its path), the pad and the camera are always in
// view, and beside them stands one instrument in full height. On a phone the pad stays under the thumbs, and the place
// above it shows the world, the camera, or an instrument.
import { useEffect } from "preact/hooks";
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
  type IconNode,
} from "lucide";
import { Icon } from "../look/Icon";
import { address, place } from "../route";
import { robotOf, subscribe, type Robot as Model } from "../store";
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
import { Status } from "../robot/Status";
import { Trouble } from "../robot/Trouble";
import "../robot/robot.css";
import "./Robot.css";

type Kind = (props: { robot: Model }) => preact.ComponentChild;
type Instrument = { name: string; title: string; icon: IconNode; Kind: Kind };

/** The instruments, one of which is open. On a phone the world and the camera take their turn among them. */
const INSTRUMENTS: Instrument[] = [
  { name: "sensors", title: "Sensors", icon: Gauge, Kind: Sensors },
  { name: "charts", title: "Charts", icon: ChartLine, Kind: Charts },
  { name: "behaviours", title: "Behaviours", icon: Sparkles, Kind: Behaviours },
  { name: "lights", title: "Lights and sounds", icon: Lightbulb, Kind: Lights },
  { name: "console", title: "Console", icon: Terminal, Kind: Console },
  { name: "events", title: "Events", icon: List, Kind: Events },
  { name: "link", title: "Link", icon: Radio, Kind: Link },
  { name: "files", title: "Files", icon: FileText, Kind: Files },
];
const VIEWS = [
  { name: "world", title: "World", icon: MapIcon },
  { name: "camera", title: "Camera", icon: CameraIcon },
];
const FIRST = INSTRUMENTS[0];

export function Robot({ id }: { id: string }) {
  const robot = robotOf(id);
  useEffect(() => subscribe({ what: "robot", of: id, rate: 10 }), [id]);
  useEffect(() => subscribe({ what: "world", of: id, rate: 25 }), [id]);
  const { part } = place.value,
    open = INSTRUMENTS.find(({ name }) => name === part) ?? FIRST,
    view = INSTRUMENTS.includes(open) && open.name === part ? "instrument" : part === "camera" ? "camera" : "world";
  const phase = robot.tick.value?.phase ?? "connecting",
    isThere = !["failed", "disconnected"].includes(phase);
  const shown = [...VIEWS, ...INSTRUMENTS];
  return (
    <div class="robot-place" data-view={view} data-there={isThere ? "yes" : "no"}>
      <section class="status" aria-label="connection">
        <Status robot={robot} />
      </section>
      <section class="stage" aria-label="world">
        {isThere ? <Stage robot={robot} /> : <Trouble robot={robot} />}
      </section>
      {isThere && (
        <>
          <section class="card pad-card" aria-label="drive">
            <Pad robot={robot} />
          </section>
          <section class="card camera-card" aria-label="camera">
            <Camera robot={robot} />
          </section>
        </>
      )}
      <nav class="rail" role="tablist" aria-label="parts of the page" aria-orientation="vertical">
        {shown.map(({ name, title, icon }) => (
          <a
            key={name}
            role="tab"
            href={address(id, name)}
            class={VIEWS.some((each) => each.name === name) ? "phone" : ""}
            aria-selected={name === (view === "instrument" ? open.name : view) || (name === open.name && part === "")}
            aria-controls="instrument"
          >
            <Icon of={icon} size={20} />
            <span>{title}</span>
          </a>
        ))}
      </nav>
      <section class="instrument" id="instrument" role="tabpanel" aria-label={open.title}>
        <h2>{open.title}</h2>
        <open.Kind key={`${id} ${open.name}`} robot={robot} />
      </section>
    </div>
  );
}
