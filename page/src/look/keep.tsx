// Save something as a file of the folder, by a name that a person may change.
import { toast } from "../store";
import type { Saved } from "../messages";
import { confirmed } from "./Dialog";

export async function keep(
  title: string,
  hint: string,
  name: string,
  save: (name: string) => Promise<Saved | undefined>,
) {
  const body = (
    <>
      <p>{hint}</p>
      <label class="field">
        Name
        <input value={name} maxLength={70} required onInput={(event) => (name = event.currentTarget.value)} />
      </label>
    </>
  );
  const saved = (await confirmed(title, "Save", body)) ? await save(name) : undefined;
  if (saved) toast(`Saved as ${saved.name}. ${saved.url} opens the world.`, true);
}
