// The vehicle that tilts, in three dimensions; where the browser has no WebGL2, a line that says so.

import { html } from "./elements.js";

const CONTEXT = { alpha: true, stencil: true };
const SELDOM = 50; // between two pictures where the processor draws, as clicks come first [ms]
const NOT_DRAWN = "The vehicle is not drawn: this browser has no WebGL 2, or has stopped it.";
const NOT_HELD = "No hover thrusts: nothing holds the vehicle level here.";

/** Return whether the processor draws, as there is no graphics card. */
function isSoftware() {
  const probe = html("canvas").getContext("webgl2");
  const info = probe?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? probe.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  probe?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

const line = (text) => html("p", { class: "nothing" }, text);

/** Show the vehicle in `root`. */
export function vehicleIn(root) {
  const canvas = html("canvas", {
    tabindex: "0",
    role: "application",
    "aria-label": "The vehicle at the time shown. Arrow keys turn the view, plus and minus zoom, 0 resets it",
    title: "Drag to turn, double-click to reset",
  });
  const note = html("p", { class: "small vehicle-note" });
  // Without a graphics card the processor draws: then without smooth edges, and more seldom.
  const isSlow = isSoftware();
  const context = canvas.getContext("webgl2", { ...CONTEXT, antialias: !isSlow });
  let scene = null; // until its module is here
  let view = null;
  let built = "";
  let posture = null;

  function fail() {
    scene = null;
    root.replaceChildren(line(NOT_DRAWN));
  }

  function draw() {
    if (!scene) return;
    if (!view) root.replaceChildren(line("No gait to draw."));
    else if (canvas.parentNode !== root) root.replaceChildren(canvas, note); // only then: it may have the focus
    const key = JSON.stringify(view);
    if (!view || key === built) return;
    built = key;
    scene.build(view);
  }

  function pose() {
    if (!scene || !posture) return;
    scene.pose(posture);
    const isHeld = posture.shares.every((share) => share !== null);
    const text = [posture.name, isHeld ? "" : NOT_HELD].filter(Boolean).join(". ");
    if (note.textContent !== text) note.textContent = text;
  }

  if (context) {
    import("./scene.js")
      .then(({ sceneIn }) => {
        scene = sceneIn(root, canvas, context, isSlow ? SELDOM : 0, fail);
        draw();
        pose();
      })
      .catch(fail);
  } else fail();

  return {
    /** Show the vehicle of a report, whose view is `next`; null: there is no gait. */
    show(next) {
      view = next;
      posture = null;
      draw();
    },
    /** Show a posture: its phase of the period, tilt angles [rad] and thrusts as shares of the weight. */
    at(next) {
      posture = next;
      pose();
    },
    /** Let the processor plan first, where it is also the one that draws. */
    rest(wanted) {
      if (isSlow) scene?.rest(wanted);
    },
    repaint: () => scene?.recolor(),
  };
}
