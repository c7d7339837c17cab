// The one component of the panel: it gives a place on the page to a class of js/, and passes on what that says.

import { hub } from "elib-joystick/hub.js";

export default {
  template: "<div></div>",
  props: { kind: String, robot: String, options: Object },
  async mounted() {
    this.wishes = [];
    const { Part } = await import(`elib-joystick/${this.kind}.js`);
    if (this.isGone) return;
    this.made = Vue.markRaw(
      new Part(this.$el, this.options ?? {}, (name, value) => {
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
    ask(name, ...values) {
      if (this.made) this.made[name](...values);
      else this.wishes?.push([name, values]);
    },
  },
};
