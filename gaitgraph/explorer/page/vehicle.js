// The vehicle drawn tilting: arms and discs whose matrices the server computed, one set for each sample.

import { html, svg } from "./elements.js";

export function vehicleIn(root) {
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
      if (!vehicleView)
        root.replaceChildren(
          html("p", { class: "nothing" }, isTable ? "Not drawn for this table." : "Drawn here, once there is a gait."),
        );
      else if (!same) build(vehicleView);
    },
    at(phase) {
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
  };
}
