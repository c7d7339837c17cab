// How a program reaches the robots of a world that the page only shows.
import { Copy } from "../look/Copy";
import type { Reachable } from "../messages";
import "./Reach.css";

const program = (url: string) => `import elib

with elib.connect("${url}") as robot:
    robot.set_speed(0.5, 0.5)  # turns a second
    robot.sleep(2)`;

export function Reach({ addresses }: { addresses: Reachable[] }) {
  const [{ url }] = addresses;
  return (
    <section class="card stack reach" aria-label="how programs reach the robots">
      <h2>{addresses.length > 1 ? "Drive these robots" : "Drive this robot"}</h2>
      <p class="small">Its page, with pad, camera and charts. Type this in a terminal:</p>
      <Copy label="the command" text={`elib joystick ${url}`} />
      <p class="small">A program in Python. One program at a time can have a robot:</p>
      <Copy label="the program" text={program(url)} />
      {addresses.length > 1 && (
        <>
          <h3>The address of each robot</h3>
          <dl>
            {addresses.map(({ name, url }) => (
              <div key={name} class="row">
                <dt>{name}</dt>
                <dd>
                  <Copy label={`the address of ${name}`} text={url} />
                </dd>
              </div>
            ))}
          </dl>
        </>
      )}
    </section>
  );
}
