// How a program reaches the robots of a world that the page only shows.
import { Copy } from "../look/Copy";
import type { Reachable } from "../messages";
import { student } from "../route";
import { can } from "../store";

/** In short lines: beside the button that copies them there is room for thirty letters. */
const program = (url: string) => `import elib

url = "${url}"
with elib.connect(url) as robot:
    # both wheels: half a turn per second,
    # so straight on, for 2 s
    robot.set_speed(0.5, 0.5)
    robot.sleep(2)`;

/** *student* is the number of the one whose robots they are; empty outside a class. */
export function Reach({ addresses, student: owner }: { addresses: Reachable[]; student: string }) {
  const [{ url }] = addresses;
  return (
    <section class="card stack reach" aria-label="how programs reach the robots">
      {owner && <h1>Student {owner}</h1>}
      <h2>{addresses.length > 1 ? "Drive these robots" : student ? "Drive your robot" : "Drive this robot"}</h2>
      <p>This page shows the world. To drive, use elib on your computer, in one of three ways.</p>
      <h3>With the mouse</h3>
      <p class="small">Type this in a terminal. It opens a page with a pad, the camera and charts:</p>
      <Copy label="the command" text={`elib joystick ${url}`} />
      <h3>With a program of your own</h3>
      <p class="small">One program at a time can drive a robot:</p>
      <Copy label="the program" text={program(url)} />
      <h3>With a finished program</h3>
      <p class="small">One that was written for another robot, such as those of the tutorial, drives this one so:</p>
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
