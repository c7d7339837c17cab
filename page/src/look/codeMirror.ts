// CodeMirror as the page uses it, a part that is loaded when code is shown.
import { python } from "@codemirror/lang-python";
import { HighlightStyle, syntaxHighlighting } from "@codemirror/language";
import { EditorState } from "@codemirror/state";
import { drawSelection, EditorView, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";

export const colours = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword, tags.bool, tags.null], color: "var(--accent)", fontWeight: "500" },
  { tag: [tags.string, tags.docString], color: "var(--good)" },
  { tag: tags.comment, color: "var(--faint)", fontStyle: "italic" },
  { tag: tags.number, color: "var(--warn)" },
  { tag: tags.meta, color: "var(--bad)" },
  { tag: tags.definition(tags.function(tags.variableName)), fontWeight: "600" },
]);

export const look = EditorView.theme({
  "&": { height: "100%", color: "var(--ink)", background: "var(--sunken)", fontSize: "var(--small)" },
  "&.cm-focused": { outline: "2px solid var(--accent)", outlineOffset: "-2px" },
  ".cm-scroller": { fontFamily: "var(--mono)", lineHeight: "1.5" },
  ".cm-content": { padding: "8px 0" },
  ".cm-gutters": { border: "0", background: "var(--sunken)", color: "var(--control)" },
});

/** Show Python that nobody can change. */
export const reader = (root: ShadowRoot, doc: string, label: string) =>
  new EditorView({
    root,
    parent: root,
    state: EditorState.create({
      doc,
      extensions: [
        lineNumbers(),
        drawSelection(),
        EditorView.lineWrapping,
        EditorState.readOnly.of(true),
        EditorView.editable.of(false),
        EditorView.contentAttributes.of({ tabindex: "0", "aria-label": label }),
        python(),
        syntaxHighlighting(colours),
        look,
      ],
    }),
  });
