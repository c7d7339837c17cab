// All robots at a glance with their world, and what is done with all of them at once; or a world without robots of the
// panel, such as that of `elib simulate --view`, or of a study.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ArrowLeft } from "lucide";
import { Button } from "../look/Button";
import { Select } from "../look/fields";
import { Icon } from "../look/Icon";
import { title } from "../look/text";
import { go, place, student } from "../route";
import { ask, can, hello, listed, overview, subscribe, worldsOfRobots } from "../store";
import { useWorld } from "../world/live";
import { World } from "../world/World";
import { Card } from "./Card";
import { Reach } from "./Reach";
import { Study } from "./Study";
import { Wall } from "./Wall";
import "./All.css";

const keys = () => listed.value.map(({ key }) => key);
const labelOf = (key: string) => listed.value.find((each) => each.key === key)?.label;

function AllRobots() {
  const behaviours = hello.value!.behaviours.filter(({ elsewhere }) => !elsewhere),
    chosen = useSignal("avoid"),
    robots = Object.values(overview.value),
    ready = keys().filter((key) => overview.value[key]?.phase === "connected"),
    runs = robots.some(({ behaviour }) => behaviour);
  const all = (what: "pause_behaviour" | "resume_behaviour" | "end_behaviour") => () => ask(what, { robots: keys() });
  return (
    <section class="card stack" aria-label="all robots">
      <div class="row">
        <h2 class="fill">All robots</h2>
        {can().connect && robots.some(({ phase }) => phase !== "connected") && (
          <Button act={() => Promise.all(keys().map((robot) => ask("connect", { robot })))}>Connect all</Button>
        )}
      </div>
      {can().drive && (
        <div class="row wrap">
          <Select
            class="fill"
            aria-label="behaviour for all robots"
            value={chosen}
            choices={behaviours.map(({ name }) => [name, title(name)])}
            choose={(name) => (chosen.value = name)}
          />
          <Button
            weight="primary"
            disabled={!ready.length}
            act={() => ask("behave", { robots: ready, name: chosen.value })}
          >
            Start for all
          </Button>
        </div>
      )}
      {runs && (
        <div class="row wrap">
          <Button act={all("pause_behaviour")}>Pause all</Button>
          <Button act={all("resume_behaviour")}>Continue all</Button>
          <Button act={all("end_behaviour")}>End all</Button>
        </div>
      )}
      <div class="cards columns list">
        {listed.value.map(
          (each) => overview.value[each.key] && <Card key={each.key} robot={each} summary={overview.value[each.key]} />,
        )}
      </div>
    </section>
  );
}

export function All() {
  const { part } = place.value,
    worlds = worldsOfRobots.value,
    isClass = worlds.length > 1 && !listed.value.length,
    chosen = worlds.some(([key]) => key === part) ? part : "";
  useEffect(() => subscribe({ what: "overview", rate: 5 }), []);
  return isClass && !chosen ? <Wall /> : <Worlds shown={chosen || (worlds[0]?.[0] ?? "")} isClass={isClass} />;
}

/** One of the worlds, and the robots; or, of a class, the world of a student. */
function Worlds({ shown, isClass }: { shown: string; isClass: boolean }) {
  const worlds = worldsOfRobots.value,
    { study } = hello.value!,
    addresses = hello.value!.robots.filter(({ name }) => !isClass || name.split(" ")[0] === shown),
    world = useWorld(shown);
  return (
    <div class="all" data-world={world.scene.value ? "yes" : "no"}>
      {world.scene.value && (
        <section class="card stage" aria-label="world">
          <World world={world} of={shown} />
        </section>
      )}
      <div class="beside stack">
        {isClass && (
          <a class="row" href="#/all">
            <Icon of={ArrowLeft} /> All students
          </a>
        )}
        {worlds.length > 1 && !isClass && (
          <Select
            aria-label="world that is shown"
            value={shown}
            choices={worlds.map(([key, name]) => [key, `${title(name)}, with ${labelOf(key)}`])}
            choose={(key) => go(`#/all/${key}`)}
          />
        )}
        {study && <Study about={study} />}
        {listed.value.length > 0 && <AllRobots />}
        {!listed.value.length && addresses.length > 0 && (
          <Reach addresses={addresses} student={student || (isClass ? shown : "")} />
        )}
      </div>
    </div>
  );
}
