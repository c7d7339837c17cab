// The WebSocket to the server; one that broke is opened again.
import { connect, hear } from "./store";

const AGAIN = 1000; // ms until a connection that broke is opened again

export function open() {
  // The page of a student of a class is at /student/7, and its WebSocket below that.
  const socket = new WebSocket(`ws://${location.host}${location.pathname.replace(/\/?$/, "/ws")}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => connect((text) => socket.send(text));
  socket.onmessage = ({ data }) => hear(data);
  socket.onclose = () => {
    connect(null);
    setTimeout(open, AGAIN);
  };
}
