// The WebSocket to the server; one that broke is opened again.
import { connect, hear, refusal } from "./store";

const AGAIN = 1000; // ms until a connection that broke is opened again

export function open() {
  // The page of a student of a class is at /student/7, and its WebSocket below that.
  const path = location.pathname.replace(/\/?$/, "/ws"),
    socket = new WebSocket(`ws://${location.host}${path}`);
  let isOpen = false;
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    isOpen = true;
    refusal.value = "";
    connect((text) => socket.send(text));
  };
  socket.onmessage = ({ data }) => hear(data);
  socket.onclose = () => {
    connect(null);
    if (!isOpen) askWhy(path);
    setTimeout(open, AGAIN);
  };
}

/** Ask why there is no WebSocket, which a browser does not tell: the program was started anew, or is full. */
async function askWhy(path: string) {
  const answer = await fetch(path).catch(() => null);
  if (answer?.status === 401) location.reload(); // it asks for the token
  refusal.value = answer?.status === 503 ? await answer.text() : "";
}
