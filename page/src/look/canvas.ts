// Drawing on a canvas, which knows no style sheet.

const probe = document.createElement("i");
probe.hidden = true;
document.documentElement.append(probe);

/** The colours of the page as they are now, by their names in tokens.css, of either scheme. */
export function inks<Name extends string>(...names: Name[]) {
  const found = names.map((name) => {
    probe.style.color = `var(--${name})`;
    return [name, getComputedStyle(probe).color];
  });
  return Object.fromEntries(found) as Record<Name, string>;
}

/** Make a canvas as sharp as the screen, and clear it; what is drawn is measured in CSS pixels. */
export function prepared(canvas: HTMLCanvasElement) {
  const density = Math.min(3, devicePixelRatio || 1),
    { clientWidth: width, clientHeight: height } = canvas,
    pen = canvas.getContext("2d")!;
  [canvas.width, canvas.height] = [Math.max(1, Math.round(width * density)), Math.max(1, Math.round(height * density))];
  pen.setTransform(density, 0, 0, density, 0, 0);
  return { pen, width, height };
}

const STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200]; // m

/** A round number of metres that is at least so many pixels long. */
export const stepOf = (scale: number, least: number) => STEPS.find((step) => step * scale >= least) ?? 500;
