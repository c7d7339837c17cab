// On which robot the program runs: on the one that it names itself, or on one that is chosen here.
import { effect, signal } from "@preact/signals";
import { Bot } from "lucide";
import { Select } from "../look/fields";
import { title } from "../look/text";
import { hello } from "../store";
import { known } from "./known";
import { Menu } from "./Menu";
import { lab, robot } from "./run";

const wish = signal({ world: "", firmware: "", seed: "", fault: "" });

effect(() => {
  const { world, ...rest } = wish.value,
    given = Object.entries(rest).filter(([, value]) => value),
    query = new URLSearchParams(given).toString();
  robot.value = world && `sim://${world}${query && `?${query}`}`;
});

export function RobotMenu() {
  const { world, firmware, seed, fault } = wish.value,
    set = (name: string) => (value: string) => (wish.value = { ...wish.value, [name]: value }),
    disabled = !world;
  const worlds = hello.value?.worlds.map(({ name }) => [name, title(name)] as const) ?? [],
    { firmwares, faults } = known.value;
  if (lab.value) return <span class="hint">In the world of the lab</span>;
  return (
    <Menu icon={Bot} text={robot.value || "Robot: as the program says"}>
      <label class="field">
        World
        <Select value={world} choices={[["", "as the program says"], ...worlds]} choose={set("world")} />
      </label>
      <label class="field">
        Firmware of the robot
        <Select
          {...{ value: firmware, disabled }}
          choices={[["", "the world's own"], ...firmwares.map((name) => [name, name] as const)]}
          choose={set("firmware")}
        />
      </label>
      <label class="field">
        What goes wrong on the link
        <Select
          {...{ value: fault, disabled }}
          choices={[["", "nothing"], ...faults.map(([name]) => [name, title(name)] as const)]}
          choose={set("fault")}
        />
        <span>{faults.find(([name]) => name === fault)?.[1]}</span>
      </label>
      <label class="field" title="The same seed gives the same noise of the sensors, and the same faults">
        Seed
        <input
          {...{ type: "number", min: 0, step: 1, value: seed, disabled, placeholder: "the world's own" }}
          onInput={({ currentTarget }) => set("seed")(currentTarget.validity.valid ? currentTarget.value : "")}
        />
      </label>
      {robot.value && (
        <p class="hint">
          The program is given <code>{robot.value}</code> in place of the robot that it names.
        </p>
      )}
    </Menu>
  );
}
