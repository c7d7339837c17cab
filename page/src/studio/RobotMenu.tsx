// On which robot the program runs: on the one that it names itself, or on one that is chosen here.
import { computed, effect, signal } from "@preact/signals";
import { Bot } from "lucide";
import { Button } from "../look/Button";
import { Select } from "../look/fields";
import { Menu } from "../look/Menu";
import { title } from "../look/text";
import { hello } from "../store";
import { known } from "./known";
import { lab } from "./programs";
import { robot } from "./run";
import { choose, hasPort } from "./serial";

const wish = signal<Record<string, string>>({});
const url = computed(() => {
  if (hasPort.value) return "webserial://";
  const { world, ...rest } = wish.value,
    query = new URLSearchParams(Object.entries(rest).filter(([, value]) => value));
  return world ? `sim://${world}${query.size ? `?${query}` : ""}` : "";
});
effect(() => void (robot.value = url.value));

export function RobotMenu() {
  const { firmwares, faults } = known.value,
    set = (key: string) => (value: string) => (wish.value = { ...wish.value, [key]: value }),
    isReal = hasPort.value,
    disabled = isReal || !wish.value.world;
  if (lab.value) return <span class="hint">In the world of the lab</span>;
  const list = (label: string, key: string, none: string, names: string[], rest = {}) => (
    <label class="field">
      {label}
      <Select
        value={wish.value[key] ?? ""}
        choices={[["", none], ...names.map((each) => [each, key === "firmware" ? each : title(each)] as const)]}
        choose={set(key)}
        {...rest}
      />
    </label>
  );
  const worlds = hello.value?.worlds.map(({ name }) => name) ?? [],
    [, about] = faults.find(([name]) => name === wish.value.fault) ?? [];
  return (
    <Menu
      icon={Bot}
      text={isReal ? "The real robot" : `Robot: ${wish.value.world ? title(wish.value.world) : "as the program says"}`}
    >
      <Button act={choose} disabled={isReal} title="Chrome and Edge reach a robot by a cable or by Bluetooth">
        Real robot …
      </Button>
      {list("World", "world", "as the program says", worlds, { disabled: isReal })}
      {disabled && !isReal && <p class="hint">Choose a world to choose what follows, too.</p>}
      {list("Firmware of the robot", "firmware", "the world's own", firmwares, { disabled })}
      {list(
        "What goes wrong on its link",
        "fault",
        "nothing",
        faults.map(([name]) => name),
        { disabled },
      )}
      {about && <p class="hint">{about}.</p>}
      <label class="field" title="The same seed gives the same noise and the same faults">
        Seed
        <input
          {...{ type: "number", min: 0, step: 1, value: wish.value.seed, disabled, placeholder: "the world's own" }}
          onInput={({ currentTarget: { validity, value } }) => set("seed")(validity.valid ? value : "")}
        />
      </label>
      {robot.value && <p class="hint">The program drives {robot.value}, whatever robot it names.</p>}
    </Menu>
  );
}
