export function All() {
  return <p class="hint">All</p>;
}
