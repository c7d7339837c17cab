import { useEffect, useRef } from "preact/hooks";

/**
 * Python to read. CodeMirror, which is loaded for it, stands in a shadow root: only there it makes its style sheets in
 * the way that the policy of the page allows. The page's colours reach into it.
 */
export function Code({ text, label }: { text: string; label: string }) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const root = box.current!.shadowRoot ?? box.current!.attachShadow({ mode: "open" }),
      view = import("./codeMirror").then(({ reader }) => reader(root, text, label));
    return () => void view.then((made) => made.destroy());
  }, [text]);
  return <div class="code well" ref={box} data-keys="" />;
}
