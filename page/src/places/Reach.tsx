// How a program reaches the robots of a world that the page only shows.
import { Copy } from "../look/Copy";
import type { Reachable } from "../messages";
import { student } from "../route";
import { can } from "../store";

const program = (url: string) => `import elib

with elib.connect("${url}") as robot:
    robot.set_speed(0.5, 0.5)  # turns a second
    robot.sleep(2)`;

/** *student* is the number of the one whose robots they are; empty outside a class. */
export function Reach({ addresses, student: owner }: { addresses: Reachable[]; student: string }) {
  const [{ url }] = addresses;
  return (
    <section class="card stack reach" aria-label="how programs reach the robots">
      {owner && <h1>Student {owner}</h1>}
      <h2>{addresses.length > 1 ? "Drive these robots" : "Drive this robot"}</h2>
      {student && <p>It is yours. This page shows it, and elib on your own computer drives it:</p>}
      <p class="small">By hand, with pad, camera and charts. Type this in a terminal:</p>
      <Copy label="the command" text={`elib joystick ${url}`} />
      <p class="small">By a program in Python. One program at a time can have a robot:</p>
      <Copy label="the program" text={program(url)} />
      <p class="small">
        A program that names another robot, as those of the tutorial do, drives this one if you run it so:
      </p>
      <Copy label="how to run a program" text={`elib run mine.py --robot ${url}`} />
      {can().edit && <p class="small">In the world, drag the robot and the boxes, and see what your program does.</p>}
      {addresses.length > 1 && (
        <>
          <h3>The address of each robot</h3>
          {addresses.map(({ name, url }) => (
            <div key={name}>
              <b>{name}</b>
              <Copy label={`the address of ${name}`} text={url} />
            </div>
          ))}
        </>
      )}
    </section>
  );
}
