// Curves, which uPlot draws. It is loaded when the first ones are shown.
import { signal } from "@preact/signals";
import type { RefObject } from "preact";
import { useEffect, useRef } from "preact/hooks";
import type UPlot from "uplot";
import "uplot/dist/uPlot.min.css";

export type Options = Omit<UPlot.Options, "width" | "height">;

export const FONT = "12px Inter Variable, sans-serif";
const uPlot = signal<typeof UPlot | null>(null);

/** Draw curves into a box, as large as it is. A plot has the options of its beginning; *anew* says when another begins. */
export function usePlot(
  box: RefObject<HTMLElement | null>,
  options: () => Options,
  data: UPlot.AlignedData,
  anew: unknown[],
) {
  const plot = useRef<UPlot>(null);
  useEffect(() => {
    if (!uPlot.value) return void import("uplot").then((loaded) => (uPlot.value = loaded.default));
    const place = box.current!,
      size = () => ({ width: place.clientWidth, height: place.clientHeight }),
      made = new uPlot.value({ ...size(), legend: { show: false }, ...options() }, data, place),
      watch = new ResizeObserver(() => made.setSize(size()));
    plot.current = made;
    made.ctx.canvas.ariaHidden = "true"; // what it shows is said by the box
    watch.observe(place);
    return () => (watch.disconnect(), made.destroy());
  }, [uPlot.value, ...anew]);
  useEffect(() => plot.current?.setData(data), [uPlot.value, data, ...anew]);
  return plot;
}
