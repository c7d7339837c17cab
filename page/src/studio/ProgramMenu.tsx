// The programs: the one that is open by its name, and what is done with them.
import { ChevronDown, Download, FilePlus, FolderOpen, Link, Trash2 } from "lucide";
import { useRef } from "preact/hooks";
import { Button } from "../look/Button";
import { confirmed } from "../look/Dialog";
import { Select } from "../look/fields";
import { save } from "../look/text";
import { toast } from "../store";
import { known } from "./known";
import { Menu } from "./Menu";
import * as programs from "./programs";

async function copyLink() {
  const link = await programs.link();
  if (link.length > programs.LONGEST_LINK) return toast("The program is too long for a link: save it as a file.");
  await navigator.clipboard.writeText(link);
  toast("The link is copied. Whoever opens it reads the program, and may run it.");
}

async function forget() {
  const text = <p>It is deleted from this browser. A file that you saved stays.</p>;
  if (await confirmed(`Delete ${programs.name.value}?`, "Delete", text)) programs.forget();
}

export function ProgramMenu() {
  const file = useRef<HTMLInputElement>(null),
    name = programs.name.value,
    { samples } = known.value,
    others = programs.names.value.filter((each) => each !== name);
  const borrow = (chosen: string) => {
    const found = samples.find((each) => each.name === chosen);
    if (found) programs.borrow(found.name, found.text, `A sample: ${found.about}`);
  };
  return (
    <div class="row">
      <input
        class="name"
        aria-label="name of the program"
        spellcheck={false}
        maxLength={64}
        value={name}
        onChange={({ currentTarget }) => (
          programs.rename(currentTarget.value),
          (currentTarget.value = programs.name.value)
        )}
      />
      <Menu icon={ChevronDown} text="Programs">
        <Button weight="quiet" icon={FilePlus} act={programs.begin}>
          New program
        </Button>
        {others.length > 0 && (
          <Select
            aria-label="another program of this browser"
            value=""
            choices={[["", "Open …"], ...others.map((each) => [each, each] as const)]}
            choose={(chosen) => chosen && programs.open(chosen, "")}
          />
        )}
        <Select
          aria-label="a sample"
          value=""
          choices={[
            ["", "Open a sample …"],
            ...samples.map((each) => [each.name, `${each.name.slice(3, -3)}: ${each.about}`] as const),
          ]}
          choose={borrow}
        />
        <Button weight="quiet" icon={FolderOpen} act={() => file.current!.click()}>
          Open a file
        </Button>
        <Button
          weight="quiet"
          icon={Download}
          act={() => save(new Blob([programs.textNow()], { type: "text/x-python" }), name)}
        >
          Save as a file
        </Button>
        <Button weight="quiet" icon={Link} act={copyLink}>
          Copy a link to this program
        </Button>
        <Button weight="quiet" icon={Trash2} disabled={!programs.names.value.includes(name)} act={forget}>
          Delete
        </Button>
      </Menu>
      <input
        ref={file}
        type="file"
        hidden
        accept=".py,text/x-python,text/plain"
        onChange={({ currentTarget: { files } }) => files?.[0] && programs.openFile(files[0])}
      />
    </div>
  );
}
