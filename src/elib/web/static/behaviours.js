// To be built.

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    box.append("behaviours");
  }
}
