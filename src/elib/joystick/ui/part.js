// The one component of the panel: it gives a place on the page to a class of js/, and passes on what that says.

import { hub } from "elib-joystick/hub.js";

/**
 * What Vue makes of this, and what it keeps.
 * @typedef {object} Component
 * @property {HTMLElement} $el
 * @property {(name: string, values: object) => void} $emit
 * @property {string} kind
 * @property {string} robot
 * @property {object} [options]
 * @property {any} made the part; each has methods of its own
 * @property {[name: string, values: unknown[]][]} wishes for the part that is not there yet
 * @property {(() => void)} [deaf]
 * @property {boolean} isGone
 */

/** @type {{ methods: object } & Record<string, unknown> & ThisType<Component>} */
export default {
  template: "<div></div>",
  props: { kind: String, robot: String, options: Object },
  async mounted() {
    this.wishes = [];
    const { Part } = await import(`elib-joystick/${this.kind}.js`);
    if (this.isGone) return;
    // @ts-expect-error: NiceGUI's page has Vue as a global.
    this.made = Vue.markRaw(
      new Part(this.$el, this.options ?? {}, (/** @type {string} */ name, /** @type {object} */ value) => {
        if (!this.isGone) this.$emit(name, value);
      }),
    );
    for (const [name, values] of this.wishes) this.made[name](...values);
    if (this.robot && this.made.show) this.deaf = hub.listen(this.robot, (robot) => this.made.show(robot));
  },
  beforeUnmount() {
    this.deaf?.();
    this.made?.close?.();
    this.isGone = true;
  },
  methods: {
    ask(/** @type {string} */ name, /** @type {unknown[]} */ ...values) {
      if (this.made) this.made[name](...values);
      else this.wishes?.push([name, values]);
    },
  },
};
