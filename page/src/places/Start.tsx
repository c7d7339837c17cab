export function Start() {
  return <p class="hint">Start</p>;
}
