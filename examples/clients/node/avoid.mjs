// Wander for some seconds without hitting anything: node --experimental-websocket avoid.mjs [SECONDS] [URL]
// Node 22 and later need no option.

const [seconds = 10, url = "ws://127.0.0.1:8700/v1"] = process.argv.slice(2);
const socket = new WebSocket(url);
const waiting = []; // what to do with the result of each request; its place is the id, from 1 on
let readings = 0;
let told = "";
const silence = setTimeout(() => fail("no message for 2 s"), 2000);

function fail(reason) {
  console.error(`ended: ${reason}`);
  process.exit(1); // the connection closes, and elib stops the robot
}

const send = (message) => socket.send(JSON.stringify(message));
const request = (message) => new Promise((resolve) => send({ ...message, id: waiting.push(resolve) }));

const openAir = {}; // the least that each sensor has read so far

/** How much more a sensor reads now than in the open. */
const above = (near, sensor) => near[sensor] - (openAir[sensor] = Math.min(openAir[sensor] ?? 4095, near[sensor]));

/** What is near slows the wheel of the other side, so the robot turns away; in revolutions per second. */
function avoid(near, cruise = 0.5) {
  const counts = (side) => above(near, `front_${side}`) + above(near, `diagonal_${side}`);
  const wheel = (side) => Math.max(-cruise, Math.round((cruise - counts(side) / 800) * 20) / 20);
  return { left: wheel("right"), right: wheel("left") };
}

/** Send new speeds, or that we are still here. Without a new reading we send nothing, and elib stops the robot. */
function drive(near) {
  const speeds = avoid(near);
  const text = JSON.stringify(speeds);
  send(text === told ? { do: "beat" } : { do: "set_speed", ...speeds });
  told = text;
  if (readings++ % 10 === 0) console.log(`left ${near.front_left}, right ${near.front_right}: wheels ${text}`);
}

socket.onerror = socket.onclose = () => fail(`no connection to ${url}`);
socket.onmessage = ({ data }) => {
  silence.refresh();
  const message = JSON.parse(data);
  if (message.error) fail(`${message.error.kind}: ${message.error.message}`);
  if (message.type === "readings") drive(message.readings.proximity);
  if (message.type === "answer") waiting[message.id - 1](message.result);
};
socket.onopen = async () => {
  const { elib, robots } = await request({ do: "hello", name: "node" });
  console.log(`elib ${elib}, robot ${robots[0].robot}: ${robots[0].url}`);
  await request({ do: "watch", readings: ["proximity"], rate: 20 });
  await new Promise((resolve) => setTimeout(resolve, seconds * 1000));
  await request({ do: "unwatch", readings: ["proximity"] }); // no reading comes after its answer: none drives again
  await request({ do: "stop" });
  console.log("the robot stands");
  process.exit();
};
