// How the robot is connected, in one line; what is dangerous stands below it in words.
import { Circle, FileText, Plug, Unplug, X } from "lucide";
import { Button } from "../look/Button";
import { confirmed } from "../look/Dialog";
import { Icon } from "../look/Icon";
import { isPhone } from "../look/screen";
import { number } from "../look/text";
import { go } from "../route";
import { can, listed, type Robot } from "../store";

export const SLOW = 0.3; // s to an answer that a person feels while driving

export const isOff = (robot: Robot) => ["disconnected", "failed"].includes(robot.tick.value?.phase ?? "connecting");

export function Status({ robot }: { robot: Robot }) {
  const tick = robot.tick.value,
    entry = listed.value.find(({ key }) => key === robot.key);
  if (!tick) return <p class="hint">Connecting …</p>;
  const { phase, phase_text, drive, link, log, recorder } = tick,
    [raw, volts, percent] = tick.readings.battery?.values ?? [],
    median = link?.median ?? 0,
    answers = median ? `answers in ${Math.round(1000 * median)} ms` : "",
    isRecording = Boolean(entry?.url.startsWith("replay:") && !entry.url.includes("fork=")),
    [begin, end] = isRecording ? ["Play", "End"] : ["Connect", "Disconnect"],
    change = phase === "connecting" ? "Cancel" : isOff(robot) ? begin : end;
  // The worst news first: nobody can stop a robot whose link is gone.
  const alarm =
    drive.may_move && phase !== "connected"
      ? "The connection is lost: the robot may still be moving. Be ready to pick it up."
      : drive.trouble && `The robot did not confirm the last command and may still be moving: ${drive.trouble}`;
  const remove = async () => {
    const text = <p>It stops, and its connection is closed. Files stay where they are.</p>;
    if (!isOff(robot) && !(await confirmed("Remove this robot?", "Remove", text))) return;
    if ((await robot.ask("remove", {})) !== undefined) go("#/");
  };
  return (
    <>
      <div class="row">
        <div class="row wrap fill">
          <h1 title={entry?.url}>{entry?.label}</h1>
          <p class="chip" role="status" data-phase={phase}>
            {phase_text}
          </p>
          {log && (
            <span class="row small">
              <Icon of={FileText} size={14} /> writing a log
            </span>
          )}
          {recorder !== null && (
            <span class="row small bad">
              <Icon of={Circle} size={12} /> recording
            </span>
          )}
          {median > SLOW && <span class="warn">slow: {answers}</span>}
          <span class="fill" />
          <span class="hint facts">
            {typeof raw === "number" && percent !== null && (
              <span title={`${number(Number(volts), 2)} V`}>battery {number(Number(percent))} %</span>
            )}
            {answers && median <= SLOW && !isPhone() && <span>{answers}</span>}
          </span>
        </div>
        {can().connect && (
          <>
            <Button
              weight={!isOff(robot) ? "quiet" : phase === "failed" ? "plain" : "primary"}
              icon={isOff(robot) ? Plug : Unplug}
              act={() => robot.ask(isOff(robot) ? "connect" : "disconnect", {})}
              {...(isPhone() && phase === "connected" ? { label: end } : { children: change })}
            />
            <Button weight="quiet" icon={X} label="Remove from this page" act={remove} />
          </>
        )}
      </div>
      <p class="alarm" role="alert" hidden={!alarm}>
        {alarm}
      </p>
    </>
  );
}
