// The vehicle that tilts: in three dimensions where the browser has WebGL2, else a drawing whose discs the server computed.

import { html, svg } from "./elements.js";

const CONTEXT = { alpha: true, stencil: true };
const SELDOM = 50; // between two pictures where the processor draws, as clicks come first [ms]

/** Return whether the processor draws, as there is no graphics card. */
function isSoftware() {
  const probe = html("canvas").getContext("webgl2");
  const info = probe?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? probe.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  probe?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Show the vehicle in `root`. */
export function vehicleIn(root) {
  const canvas = html("canvas", {
    tabindex: "0",
    role: "application",
    "aria-label": "The vehicle at the time shown. Arrow keys turn the view, plus and minus zoom, 0 resets it",
    title: "Drag to turn, double-click to reset",
  });
  // Without a graphics card the processor draws: then without smooth edges, and more seldom.
  const isSlow = isSoftware();
  const context = canvas.getContext("webgl2", { ...CONTEXT, antialias: !isSlow });
  let picture = null; // until the module of the scene is here
  let shown = [null, false];
  let posture = null;

  function use(next) {
    picture = next;
    picture.show(...shown);
    if (posture) picture.at(posture);
  }

  const drawInstead = () => use(drawingIn(root));
  if (context) {
    const pause = isSlow ? SELDOM : 0;
    import("./scene.js")
      .then(({ sceneIn }) => use(solidIn(root, sceneIn(root, canvas, context, pause, drawInstead), canvas)))
      .catch(drawInstead);
  } else drawInstead();

  return {
    /** Show the vehicle of a report, whose view is `next`; null: there is no gait. */
    show(next, isTable) {
      shown = [next, isTable];
      posture = null;
      picture?.show(next, isTable);
    },
    /** Show a posture: its phase of the period, tilt angles [rad] and thrusts as shares of the weight. */
    at(next) {
      posture = next;
      picture?.at(next);
    },
    /** Let the processor plan first, where it is also the one that draws. */
    rest(wanted) {
      if (isSlow) picture?.rest?.(wanted);
    },
    repaint: () => picture?.repaint(),
  };
}

/** Return the picture in three dimensions. */
function solidIn(root, scene, canvas) {
  const note = html("p", { class: "small vehicle-note" });
  let built = "";
  return {
    show(next) {
      const isIn = canvas.parentNode === root;
      if (!next) root.replaceChildren(nothing(false));
      else if (!isIn) root.replaceChildren(canvas, note); // only then: it may have the focus
      const key = JSON.stringify(next && [next.bearings, next.height, next.rotors.map((rotor) => rotor.clockwise)]);
      if (!next || key === built) return;
      built = key;
      scene.build({
        bearings: next.bearings,
        clockwise: next.rotors.map((rotor) => rotor.clockwise),
        height: next.height ?? 0,
      });
    },
    at(posture) {
      scene.pose(posture);
      const isHeld = posture.shares.every((share) => share !== null);
      const held = isHeld ? "" : "No hover thrusts: nothing holds the vehicle level here.";
      const text = [posture.name, held].filter(Boolean).join(". ");
      if (note.textContent !== text) note.textContent = text;
    },
    rest: scene.rest,
    repaint: scene.recolor,
  };
}

const nothing = (isTable) =>
  html("p", { class: "nothing" }, isTable ? "Not drawn for this table." : "No gait to draw.");

function drawingIn(root) {
  let vehicleView = null;
  let discs = [];
  let thrusts = [];
  let frame = -1;

  function build(next) {
    const [width, height] = next.size;
    const picture = svg("svg", {
      viewBox: `0 0 ${width} ${height}`,
      role: "img",
      "aria-label": "The vehicle, its four rotors tilted about their arms as at the time shown",
    });
    thrusts = next.rotors.map((rotor, k) => svg("path", { class: `thrust alpha${k + 1}` }));
    const names = [];
    discs = next.rotors.map((rotor, k) => {
      const [x0, y0, x1, y1] = rotor.arm;
      picture.append(svg("path", { class: "arm", d: `M${x0} ${y0}L${x1} ${y1}` }));
      names.push(
        svg(
          "text",
          {
            class: `rotor-name alpha${k + 1}`,
            x: rotor.label[0],
            y: rotor.label[1] + 7,
            "text-anchor": "middle",
          },
          `α${k + 1}`,
        ),
      );
      return svg("circle", { class: `disc alpha${k + 1}`, r: 1 });
    });
    picture.append(
      svg("path", { class: "arm", d: `M${next.hub.join(" ")}L${next.rotors[0].arm.slice(0, 2).join(" ")}` }),
      svg("path", { class: "arm nose", d: `M${next.hub.join(" ")}L${next.nose.join(" ")}` }),
      svg("circle", { class: "hub", cx: next.hub[0], cy: next.hub[1], r: 6 }),
      ...next.order.flatMap((k) => [discs[k], thrusts[k]]), // what is far is drawn first
      ...names,
    );
    root.replaceChildren(picture);
  }

  return {
    show(next, isTable) {
      const same =
        vehicleView &&
        next &&
        JSON.stringify([vehicleView.size, vehicleView.rotors.map((r) => r.arm)]) ===
          JSON.stringify([next.size, next.rotors.map((r) => r.arm)]);
      vehicleView = next;
      frame = -1;
      if (!vehicleView) root.replaceChildren(nothing(isTable));
      else if (!same) build(vehicleView);
    },
    at({ phase }) {
      if (!vehicleView) return;
      const next = Math.round(phase * (vehicleView.frames - 1));
      if (next === frame) return;
      frame = next;
      discs.forEach((disc, k) => {
        const matrix = vehicleView.rotors[k].disc[frame];
        disc.setAttribute("transform", `matrix(${matrix.join(" ")})`);
        thrusts[k].setAttribute("d", `M${matrix[4]} ${matrix[5]}L${vehicleView.rotors[k].thrust[frame].join(" ")}`);
      });
    },
    repaint() {}, // its colors are the style sheet's
  };
}
