import { useEffect, useRef } from "preact/hooks";

/**
 * Python to read, in colours. CodeMirror stands in a shadow root, for there alone it makes its style sheets in the way
 * that the page's security policy allows; colours of the page reach into it.
 */
export function Code({ text, label }: { text: string; label: string }) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const root = box.current!.shadowRoot ?? box.current!.attachShadow({ mode: "open" });
    let close = () => {};
    let isOpen = true;
    void import("./codeMirror").then(({ reader }) => {
      if (!isOpen) return;
      const view = reader(root, text, label);
      close = () => view.destroy();
    });
    return () => {
      isOpen = false;
      close();
    };
  }, [text]);
  return <div class="code" ref={box} data-keys="" />;
}
