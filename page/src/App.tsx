// The frame of the page: the robots on top, STOP always in the same place, and below them what the address says.
import { Moon, Plus, Sun } from "lucide";
import { useEffect, useRef } from "preact/hooks";
import { Dialog } from "./look/Dialog";
import { Button } from "./look/Button";
import { Select } from "./look/fields";
import { Icon } from "./look/Icon";
import { isDark, toggleTheme } from "./look/theme";
import { Toasts } from "./look/Toasts";
import { All } from "./places/All";
import { Robot } from "./places/Robot";
import { Start } from "./places/Start";
import { address, go, place } from "./route";
import { stop, stopped, stops } from "./stop";
import { can, hello, isSilent, listed, refusal } from "./store";
import "./App.css";

const MAX_TABS = 5; // of robots; more are chosen from a list

type TabProps = { to: string; isOpen: boolean; title: string; label?: string; children: preact.ComponentChildren };

function Tab({ to, isOpen, title, label, children }: TabProps) {
  const link = useRef<HTMLAnchorElement>(null);
  useEffect(() => {
    if (isOpen) link.current?.scrollIntoView({ block: "nearest", inline: "center" }); // of twenty robots, some are out of sight
  }, [isOpen]);
  return (
    <a
      ref={link}
      class="button place"
      href={to}
      title={title}
      aria-label={label}
      aria-current={isOpen ? "page" : undefined}
    >
      {children}
    </a>
  );
}

function Header() {
  const { kind, robot } = place.value;
  return (
    <header class="bar row">
      <a class="brand row" href="#/" aria-label="elib">
        <img src="/icon.svg" alt="" width={22} height={22} />
        <b>elib</b>
      </a>
      <nav class="row scrolls" aria-label="robots">
        {listed.value.length > 1 && (
          <Tab to="#/all" isOpen={kind === "all"} title="all robots and their world">
            All {listed.value.length > MAX_TABS && listed.value.length} robots
          </Tab>
        )}
        {listed.value.length > MAX_TABS ? (
          <Select
            aria-label="robot"
            value={kind === "robot" ? robot : ""}
            choices={[["", "One robot …"], ...listed.value.map(({ key, label }) => [key, label] as const)]}
            choose={(key) => go(key ? address(key) : "#/all")}
          />
        ) : (
          listed.value.map(({ key, label, url }) => (
            <Tab key={key} to={address(key)} isOpen={kind === "robot" && robot === key} title={url}>
              {label}
            </Tab>
          ))
        )}
      </nav>
      {can().connect && listed.value.length > 0 && (
        <Tab to="#/start" isOpen={kind === "start"} title="another robot" label="another robot">
          <Icon of={Plus} size={16} />
          <span>Robot</span>
        </Tab>
      )}
      <span class="fill" />
      <Button weight="quiet" icon={isDark() ? Sun : Moon} label="switch between light and dark" act={toggleTheme} />
      {can().drive && (stopped.value || listed.value.length > 1) && (
        <button key={stops.value} type="button" id="stop" class="stop" aria-keyshortcuts="Space Escape" onClick={stop}>
          {stopped.value ? "STOP" : "STOP ALL"} <kbd>space</kbd>
        </button>
      )}
    </header>
  );
}

function Place() {
  if (!hello.value) return <p class="trouble hint">Connecting …</p>;
  const { kind, robot } = place.value;
  if (kind === "start") return <Start />;
  return kind === "robot" ? <Robot key={robot} id={robot} /> : <All />;
}

export function App() {
  return (
    <>
      <Header />
      {isSilent.value && (
        <p class="silence alarm" role="alert">
          {refusal.value || "The program does not answer. What is shown is old."}
        </p>
      )}
      <main>
        <Place />
      </main>
      <Toasts />
      <Dialog stop={stop} />
    </>
  );
}
