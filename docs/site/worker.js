// A page that was opened as a file may not start a worker. There the search runs in a hidden frame of the page.
// Messages are copied, as a worker's are: with a shared message the search clears its field at each letter.
if (location.protocol === "file:") {
  window.Worker = class {
    onmessage = null;

    constructor(address) {
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      document.body.append(this.frame);
      const inside = this.frame.contentWindow;
      inside.postMessage = (data) => {
        const copy = structuredClone(data);
        setTimeout(() => this.onmessage?.({ data: copy }));
      };
      const script = inside.document.createElement("script");
      this.isLoaded = new Promise((resolve) => (script.onload = resolve));
      script.src = address;
      inside.document.head.append(script);
    }

    postMessage(data) {
      const copy = structuredClone(data);
      this.isLoaded.then(() => this.frame.contentWindow?.onmessage({ data: copy }));
    }

    terminate() {
      this.frame.remove();
    }
  };
}
