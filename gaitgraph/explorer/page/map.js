// Mouse, touch and keyboard on the (α1, α2) map. This module reports what they do; it knows no rule of a gait.

import { HALF_PI, angle, clamped, snapped, tidied } from "./angles.js";
import { pictureIn } from "./picture.js";

const REACH = { mouse: 11, touch: 22, pen: 16 }; // how near to a waypoint a press grabs it [px]
const SLIP = 5; // a press that moves less than this is a click [px]

/**
 * Make the map inside `root`.
 *
 * `on` has the functions: add(point, index), move(index, point), drop() after a drag, remove(index),
 * polygon(kind, ring), movePolygon(kind, index, ring), removePolygon(kind, index), say(text), modeChanged(mode).
 */
export function mapIn(root, on) {
  const view = pictureIn(root);
  const { picture, shown, pixels, raw, readout, settled, x, y } = view;
  const { paintCrosshair, paintDraft, paintPolygons, paintWaypoints } = view;
  let press = null;
  let lastHit = { index: null, time: 0 };

  // Mouse and touch ------------------------------------------------------------------------------------------------------

  function nearest(points, target, reach) {
    let found = null;
    points.forEach((p, index) => {
      const distance = pixels(p, target);
      if (distance <= reach && (!found || distance < found.distance)) found = { index, distance };
    });
    return found?.index ?? null;
  }

  function inside(ring, [a, b]) {
    let odd = false;
    for (let i = 0, j = ring.length - 1; i < ring.length; j = i, i += 1) {
      const [p, q] = [ring[i], ring[j]];
      if (p[1] > b !== q[1] > b && a < ((q[0] - p[0]) * (b - p[1])) / (q[1] - p[1]) + p[0]) odd = !odd;
    }
    return odd;
  }

  function toSegment(p, q, target) {
    const [px, py, qx, qy, tx, ty] = [x(p[0]), y(p[1]), x(q[0]), y(q[1]), x(target[0]), y(target[1])];
    const square2 = (qx - px) ** 2 + (qy - py) ** 2;
    const part = square2 ? Math.max(0, Math.min(1, ((tx - px) * (qx - px) + (ty - py) * (qy - py)) / square2)) : 0;
    return Math.hypot(px + part * (qx - px) - tx, py + part * (qy - py) - ty);
  }

  function onEdge(ring, target, reach) {
    return ring.some((p, k) => toSegment(p, ring[(k + 1) % ring.length], target) <= reach);
  }

  function hitAt(point, pointer) {
    const reach = REACH[pointer] ?? REACH.mouse;
    const chosen = shown.selected;
    if (chosen && chosen.kind !== "waypoint") {
      const corner = nearest(shown.state[chosen.kind][chosen.index] ?? [], point, reach);
      if (corner !== null) return { ...chosen, corner };
    }
    const waypoint = nearest(shown.state.waypoints, point, reach);
    if (waypoint !== null) return { kind: "waypoint", index: waypoint };
    for (const [kind, hits] of [
      ["keep_out", (ring) => inside(ring, point) || onEdge(ring, point, 6)],
      ["keep_in", (ring) => onEdge(ring, point, 6)], // its inside is where waypoints go
    ]) {
      const index = shown.state[kind].findLastIndex(hits);
      if (index >= 0) return { kind, index };
    }
    return null;
  }

  function select(target) {
    shown.selected = target;
    if (target?.kind === "waypoint") shown.crosshair = [...shown.state.waypoints[target.index]];
    paintPolygons();
    paintWaypoints();
  }

  const isOutside = (point) => point.some((a) => Math.abs(a) > HALF_PI + (6 / view.box().side) * Math.PI);

  function showKeyboard(visible) {
    if (shown.keyboard === visible) return;
    shown.keyboard = visible;
    paintCrosshair();
    paintDraft();
  }

  picture.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !shown.state) return;
    showKeyboard(false);
    const point = raw(event);
    if (isOutside(point)) return;
    press = { from: [event.clientX, event.clientY], point, hit: null, moved: false, shift: event.shiftKey };
    if (shown.mode === "waypoints") {
      press.hit = hitAt(point, event.pointerType);
      if (press.hit) {
        const { kind, index, corner } = press.hit;
        if (kind !== "waypoint") {
          press.ring = shown.state[kind][index];
          press.grip = press.ring[corner] ?? point;
        }
        select({ kind, index });
      }
    }
    picture.setPointerCapture(event.pointerId);
  });

  picture.addEventListener("pointermove", (event) => {
    if (!shown.state) return;
    const point = raw(event);
    shown.hover = isOutside(point) ? null : point.map(clamped);
    readout(shown.hover && settled(shown.hover));
    if (shown.draft.length) paintDraft();
    if (!press) {
      const hit = shown.mode === "waypoints" && shown.hover ? hitAt(point, event.pointerType) : null;
      picture.classList.toggle("over", hit !== null);
      return;
    }
    if (!press.moved && Math.hypot(event.clientX - press.from[0], event.clientY - press.from[1]) < SLIP) return;
    press.moved = true;
    drag(press, point);
  });

  function drag({ hit, ring, grip, point: from }, point) {
    if (!hit) return;
    if (hit.kind === "waypoint") {
      const target = settled(point);
      const [p, q] = shown.state.waypoints[hit.index];
      if (p !== target[0] || q !== target[1]) on.move(hit.index, target);
      return;
    }
    if (hit.corner !== undefined) {
      on.movePolygon(
        hit.kind,
        hit.index,
        ring.map((p, k) => (k === hit.corner ? settled(point) : p)),
      );
      return;
    }
    const by = settled(grip.map((a, k) => a + point[k] - from[k])).map((a, k) => a - settled(grip)[k]);
    on.movePolygon(
      hit.kind,
      hit.index,
      ring.map((p) => p.map((a, k) => clamped(a + by[k]))),
    );
  }

  function release() {
    if (!press) return;
    const { moved, hit, point, shift } = press;
    press = null;
    if (moved) {
      if (hit) on.drop();
      return;
    }
    if (hit && !isBeside(hit, point)) {
      // Two clicks are a double click only if the waypoint existed before the first one.
      const now = performance.now();
      if (hit.kind === "waypoint" && lastHit.index === hit.index && now - lastHit.time < 400) {
        lastHit = { index: null, time: 0 };
        on.remove(hit.index);
      } else {
        lastHit = { index: hit.kind === "waypoint" ? hit.index : null, time: now };
      }
      return;
    }
    const target = settled(point);
    if (shown.mode !== "waypoints") return addCorner(target);
    if (shown.selected) select(null);
    lastHit = { index: null, time: 0 };
    on.add(target, shift ? nearestLeg(target) : shown.state.waypoints.length);
  }

  /** Whether a tap near a waypoint means the free place beside it: a finger grabs from farther away than it points. */
  function isBeside({ kind, index }, point) {
    if (kind !== "waypoint") return false;
    const from = shown.state.waypoints[index];
    const grid = (view.box().side / 16) * Number(shown.state.view.snap);
    return pixels(from, point) > Math.max(REACH.mouse, grid / 2);
  }

  // A touch that grabs something drags it; any other one scrolls the page. The browser asks before pointermove.
  picture.addEventListener(
    "touchstart",
    (event) => {
      const point = raw(event.touches[0]);
      if (!shown.state || isOutside(point)) return;
      if (shown.mode === "waypoints" && event.touches.length === 1 && hitAt(point, "touch")) event.preventDefault();
    },
    { passive: false },
  );

  picture.addEventListener("pointerup", release);
  picture.addEventListener("pointercancel", () => {
    if (press?.moved && press.hit) on.cancel();
    press = null;
  });
  picture.addEventListener("pointerleave", () => {
    shown.hover = null;
    readout(null);
    paintDraft();
  });

  /** Return where in the order of the waypoints a new one stands, if it goes to the leg that it lies nearest to. */
  function nearestLeg(target) {
    const points = shown.state.waypoints;
    let best = { index: points.length, distance: Infinity };
    points.forEach((p, k) => {
      const distance = toSegment(p, points[(k + 1) % points.length], target);
      if (distance < best.distance) best = { index: k + 1, distance };
    });
    return best.index;
  }

  // Polygons ------------------------------------------------------------------------------------------------------

  function addCorner(target) {
    const [first] = shown.draft;
    if (first && shown.draft.length >= 3 && pixels(first, target) <= 8) return closeDraft();
    const last = shown.draft.at(-1);
    if (last && last[0] === target[0] && last[1] === target[1]) return undefined;
    shown.draft.push(target);
    paintDraft();
    on.say(`Corner ${shown.draft.length}: α1 ${angle(target[0])}, α2 ${angle(target[1])}`);
    return undefined;
  }

  function closeDraft() {
    if (shown.draft.length < 3) {
      on.say("A polygon has at least 3 corners");
      return;
    }
    const ring = shown.draft;
    const kind = shown.mode;
    setMode("waypoints");
    on.polygon(kind, ring);
  }

  function setMode(mode) {
    shown.mode = mode;
    shown.draft = [];
    picture.classList.toggle("drawing", mode !== "waypoints");
    if (mode !== "waypoints" && shown.selected) select(null);
    paintDraft();
    on.modeChanged(mode);
  }

  // The keyboard --------------------------------------------------------------------------------------------------

  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

  function step(direction, fine) {
    const by = fine ? Math.PI / 128 : Math.PI / 16;
    const chosen = shown.selected?.kind === "waypoint" ? shown.selected.index : null;
    const from = chosen === null ? shown.crosshair : shown.state.waypoints[chosen];
    const moved = from.map((a, k) => clamped(a + direction[k] * by));
    const target = moved.map(shown.state.view.snap && !fine ? snapped : tidied);
    shown.crosshair = target;
    if (chosen !== null) on.move(chosen, target);
    paintCrosshair();
    paintDraft();
    readout(target);
    on.say(`${chosen === null ? "" : `Waypoint ${chosen + 1}: `}α1 ${angle(target[0])}, α2 ${angle(target[1])}`);
  }

  function cycle(by) {
    const count = shown.state.waypoints.length;
    if (!count) return on.say("No waypoints");
    const none = by > 0 ? -1 : 0;
    const from = shown.selected?.kind === "waypoint" ? shown.selected.index : none;
    const index = (from + by + count) % count;
    select({ kind: "waypoint", index });
    paintCrosshair();
    const [p, q] = shown.state.waypoints[index];
    return on.say(`Waypoint ${index + 1} of ${count}: α1 ${angle(p)}, α2 ${angle(q)}`);
  }

  function enter() {
    if (shown.selected) select(null);
    else on.add([...shown.crosshair], shown.state.waypoints.length);
  }

  /** Take back the last corner of a drawing, or remove what is chosen; return whether there was such a thing. */
  function removeAny() {
    if (shown.mode !== "waypoints") {
      shown.draft.pop();
      paintDraft();
      return true;
    }
    if (!shown.selected) return false;
    const { kind, index } = shown.selected;
    if (kind === "waypoint") on.remove(index);
    else on.removePolygon(kind, index);
    return true;
  }

  /** End a drag without a change, a drawing, or a choice; return whether there was such a thing. */
  function escape() {
    if (press?.moved) {
      press = null;
      on.cancel();
    } else if (shown.mode !== "waypoints") setMode("waypoints");
    else if (shown.selected) select(null);
    else return false;
    return true;
  }

  const KEYS = {
    "[": () => cycle(-1),
    "]": () => cycle(1),
    Enter: () => (shown.mode === "waypoints" ? enter() : closeDraft()),
    " ": () => (shown.mode === "waypoints" ? enter() : addCorner([...shown.crosshair])),
    Delete: removeAny,
    Backspace: removeAny,
    Escape: escape,
  };

  function pressed(event) {
    if (event.key in ARROWS) step(ARROWS[event.key], event.shiftKey);
    else if (!(event.key in KEYS) || KEYS[event.key]() === false) return;
    event.preventDefault();
  }

  picture.addEventListener("keydown", (event) => {
    if (!shown.state || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in ARROWS || "[] ".includes(event.key) || event.key === "Enter") showKeyboard(true);
    pressed(event);
  });
  picture.addEventListener("keyup", (event) => {
    if (event.key in ARROWS) on.drop();
  });
  picture.addEventListener("blur", () => {
    showKeyboard(false);
    on.drop();
  });
  picture.addEventListener("focus", () => {
    if (picture.matches(":focus-visible")) showKeyboard(true);
  });

  return {
    element: picture,
    setMode,
    select,
    mode: () => shown.mode,
    closeDraft,
    /** Forget what the pointer holds, so that its moves change nothing until it grabs again. */
    letGo: () => {
      press = null;
    },
    hasDraft: () => shown.draft.length > 0,
    show: view.show,
    showDot: view.showDot,
    phaseAt: view.phaseAt,
    point: view.point,
    repaint: view.repaint,
  };
}
