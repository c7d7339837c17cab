import { X } from "lucide";
import { closeToast, toasts } from "../store";
import { Button } from "./Button";
import "./Toasts.css";

/** What went wrong, or was done, for a while, over the page. */
export const Toasts = () => (
  <div class="toasts stack" role="status" aria-live="polite">
    {toasts.value.map(({ id, text, isGood }) => (
      <p class={`toast row ${isGood ? "card" : "alarm"}`} role="alert" key={id}>
        <span class="fill">{text}</span>
        <Button weight="quiet" icon={X} label="close" act={() => closeToast(id)} />
      </p>
    ))}
  </div>
);
