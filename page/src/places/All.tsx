// All robots at a glance with their world, and what is done with all of them at once; or a world without robots of the
// panel, such as that of `elib simulate --view`, or of a study.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { Button } from "../look/Button";
import { title } from "../look/text";
import { ask, can, hello, listed, overview, subscribe, worldsOfRobots } from "../store";
import { useWorld } from "../world/live";
import { World } from "../world/World";
import { Card } from "./Card";
import { Reach } from "./Reach";
import "./All.css";

const keys = () => listed.value.map(({ key }) => key);

function AllRobots() {
  const behaviours = hello.value!.behaviours.filter(({ elsewhere }) => !elsewhere),
    chosen = useSignal("avoid"),
    robots = Object.values(overview.value),
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
          <select
            class="fill"
            aria-label="behaviour for all robots"
            value={chosen}
            onChange={({ currentTarget }) => (chosen.value = currentTarget.value)}
          >
            {behaviours.map(({ name }) => (
              <option key={name} value={name}>
                {title(name)}
              </option>
            ))}
          </select>
          <Button weight="primary" act={() => ask("behave", { robots: keys(), name: chosen.value })}>
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
      <div class="cards">
        {listed.value.map(
          (each) => overview.value[each.key] && <Card key={each.key} robot={each} summary={overview.value[each.key]} />,
        )}
      </div>
    </section>
  );
}

/** The study, whose charts only its page loads. */
function Study() {
  const part = useSignal<typeof import("./Study") | null>(null);
  useEffect(() => {
    import("./Study").then((loaded) => (part.value = loaded));
  }, []);
  return part.value && <part.value.Study about={hello.value!.study!} />;
}

export function All() {
  const chosen = useSignal(""),
    worlds = worldsOfRobots.value,
    shown = worlds.some(([key]) => key === chosen.value) ? chosen.value : (worlds[0]?.[0] ?? ""),
    { study, robots = [] } = hello.value!;
  useEffect(() => subscribe({ what: "overview", rate: 5 }), []);
  const world = useWorld(shown);
  return (
    <div class="all" data-world={world.scene.value ? "yes" : "no"}>
      {world.scene.value && (
        <section class="stage" aria-label="world">
          <World world={world} of={shown} />
        </section>
      )}
      <div class="beside">
        {worlds.length > 1 && (
          <select
            aria-label="world that is shown"
            value={shown}
            onChange={({ currentTarget }) => (chosen.value = currentTarget.value)}
          >
            {worlds.map(([key, name]) => (
              <option key={key} value={key}>
                {title(name)}, with {listed.value.find((each) => each.key === key)?.label}
              </option>
            ))}
          </select>
        )}
        {study && <Study />}
        {listed.value.length > 0 && <AllRobots />}
        {!listed.value.length && robots.length > 0 && <Reach addresses={robots} />}
      </div>
    </div>
  );
}
