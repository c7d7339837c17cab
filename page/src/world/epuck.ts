// The shapes of an e-puck, in metres: what is opaque, its clear body, its light ring, and the arrow of its front.
import * as three from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";

import type { Hello } from "../messages";

export const LED_HEIGHT = 0.041;

function painted(geometry: three.BufferGeometry, colour: string) {
  const { r, g, b } = new three.Color(colour),
    count = geometry.attributes.position.count;
  return geometry.setAttribute("color", new three.Float32BufferAttribute(Array(count).fill([r, g, b]).flat(), 3));
}

/** An upright cylinder from one height to another. */
const drum = (radius: number, from: number, to: number, x = 0, y = 0, sides = 22, open = false) =>
  new three.CylinderGeometry(radius, radius, to - from, sides, 1, open)
    .rotateX(Math.PI / 2)
    .translate(x, y, (from + to) / 2);

const block = (length: number, width: number, from: number, to: number, x: number, y: number, turn = 0) =>
  new three.BoxGeometry(length, width, to - from).rotateZ(turn).translate(x, y, (from + to) / 2);

/** Everything opaque, in one piece. */
function solid({ ring, body }: Hello) {
  const [wheel, out] = [body.wheel / 2, body.axle / 2];
  const wheels = [-1, 1].flatMap((side) => [
    painted(new three.CylinderGeometry(wheel, wheel, 0.003, 22).translate(0, side * out, wheel), "#17191d"),
    painted(new three.CylinderGeometry(0.015, 0.015, 0.004, 12).translate(0, side * out, wheel), "#8d949c"),
  ]);
  return mergeGeometries([
    ...wheels,
    painted(drum(0.035, 0.0285, 0.031), "#2f9157"), // the main board
    painted(block(0.03, 0.036, 0.006, 0.027, -0.004, 0), "#c9d2cc"), // battery and motors within the body
    painted(drum(0.0285, 0.0445, 0.0465), "#2a7a4a"), // the board on top
    ...[45, 135, 225, 315].map((angle) => {
      const [x, y] = [0.024 * Math.cos((angle * Math.PI) / 180), 0.024 * Math.sin((angle * Math.PI) / 180)];
      return painted(drum(0.0016, 0.031, 0.048, x, y, 6), "#c8a24a"); // spacers
    }),
    painted(drum(0.0085, 0.0465, 0.0495, -0.0145, 0), "#15171b"), // speaker
    painted(drum(0.0025, 0.0495, 0.0497, -0.0145, 0, 12), "#4a4f57"),
    painted(block(0.006, 0.006, 0.0465, 0.05, 0.002, 0.018), "#2a2d33"), // selector
    painted(block(0.005, 0.009, 0.0465, 0.049, 0.002, -0.018), "#d9dde2"), // connector
    painted(block(0.005, 0.009, 0.023, 0.0285, 0.0305, 0), "#15171b"), // camera
    painted(
      new three.CylinderGeometry(0.0025, 0.0025, 0.003, 8).rotateZ(Math.PI / 2).translate(0.0338, 0, 0.0258),
      "#56606e",
    ),
    ...ring.sensors.map((angle) =>
      painted(block(0.003, 0.005, 0.031, 0.0345, 0.0325 * Math.cos(angle), 0.0325 * Math.sin(angle), angle), "#22262d"),
    ),
  ]);
}

/** The clear body: round in front and at the back, flat where the wheels are. */
function body() {
  const shape = drum(0.0335, 0.004, 0.0285, 0, 0, 28),
    { position } = shape.attributes;
  for (let k = 0; k < position.count; k++) position.setY(k, Math.max(-0.0235, Math.min(0.0235, position.getY(k))));
  return shape;
}

function arrow() {
  const shape = new three.Shape();
  shape.moveTo(0.0175, 0);
  shape.lineTo(-0.003, 0.0115);
  shape.lineTo(0.001, 0);
  shape.lineTo(-0.003, -0.0115);
  return new three.ShapeGeometry(shape).translate(0, 0, 0.0506);
}

export const epuck = (about: Hello) => ({
  solid: solid(about),
  body: body(),
  ring: mergeGeometries([
    drum(0.0356, 0.034, 0.0425, 0, 0, 28, true),
    new three.RingGeometry(0.0285, 0.0356, 28).translate(0, 0, 0.0425),
  ]),
  arrow: arrow(),
});
