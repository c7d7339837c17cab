// What a beginner needs to know, and how to find the rest.
import { CircleHelp } from "lucide";
import { Menu } from "../look/Menu";
import { BASICS, known } from "./known";

export const Help = () => (
  <Menu icon={CircleHelp} text="Help">
    {BASICS.map((wanted) => {
      const { signature, about } = known.value.robot.find(({ name }) => name === wanted) ?? {};
      return (
        <p key={wanted}>
          <code>robot.{signature}</code>
          <br />
          <span class="hint">{about}</span>
        </p>
      );
    })}
    <p>Type “robot.” in the editor to see all commands, and point at a name to see what it means.</p>
    <p>A loop needs robot.sleep(0.05): the robot lives while the program waits.</p>
  </Menu>
);
