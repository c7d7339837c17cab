// The programs: the one that is open by its name, and what is done with them.
import * as icons from "lucide";
import { useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { confirmed } from "../look/Dialog";
import { Select } from "../look/fields";
import { closeMenu, Menu } from "../look/Menu";
import { save } from "../look/text";
import { toast } from "../store";
import { known } from "./known";
import * as programs from "./programs";

async function copyLink() {
  const link = await programs.link();
  if (link.length > programs.LONGEST_LINK) return toast("The program is too long for a link: save it as a file.");
  await navigator.clipboard.writeText(link);
  toast("The link is copied. Whoever opens it sees the program, and may run it.", true);
}

async function forget() {
  const text = <p>It is deleted from this browser. A file that you saved stays.</p>;
  if (await confirmed(`Delete ${programs.name.value}?`, "Delete", text)) programs.forget();
}

export function ProgramMenu() {
  const file = useRef<HTMLInputElement>(null),
    name = programs.name.value,
    { samples } = known.value;
  const tool = (icon: icons.IconNode, text: string, act: () => unknown, disabled = false) => (
    <Button weight="quiet" {...{ icon, disabled }} act={() => (closeMenu(), act())} children={text} />
  );
  const list = (first: string, choices: [name: string, text: string][], choose: (name: string) => unknown) => (
    <Select
      {...{ "aria-label": first, value: "", disabled: !choices.length }}
      choices={[["", `${first} …`], ...choices]}
      choose={(chosen) => chosen && (closeMenu(), choose(chosen))}
    />
  );
  const borrow = (chosen: string) => {
    const { text, about } = samples.find((each) => each.name === chosen)!;
    programs.borrow(chosen, text, `A sample: ${about}`);
  };
  return (
    <>
      <input
        {...{ class: "name", "aria-label": "name of the program", spellcheck: false, maxLength: 60, value: name }}
        onChange={({ currentTarget: field }) => (programs.rename(field.value), (field.value = programs.name.value))}
      />
      <Menu icon={icons.ChevronDown} text="Programs">
        {tool(icons.FilePlus, "New", programs.begin)}
        {tool(icons.Workflow, "New state machine", programs.beginMachine)}
        {list(
          "Open another",
          programs.names.value.map((each) => [each, each]),
          programs.open,
        )}
        {list(
          "Open a sample",
          samples.map((each) => [each.name, `${each.name}: ${each.about}`]),
          borrow,
        )}
        {tool(icons.FolderOpen, "Open a file", () => file.current!.click())}
        {tool(icons.Download, "Save as a file", () => save(new Blob([programs.textNow()]), name))}
        {tool(icons.Link, "Copy a link to it", copyLink)}
        {tool(icons.Trash2, "Delete", forget, !programs.isOwn.value)}
      </Menu>
      <input
        {...({ ref: file, type: "file", hidden: true, accept: ".py" } as const)}
        onChange={({ currentTarget: { files } }) => files?.[0] && programs.openFile(files[0])}
      />
    </>
  );
}
