// The vehicle in three dimensions: arms, ducts that tilt, thrusts, and a shadow on the ground. It draws when asked to.
//
// Lengths are in arm lengths; the axes are the body's: x forward, y left, z up. The vehicle is level.

import {
  CanvasTexture,
  CircleGeometry,
  Color,
  ConeGeometry,
  CylinderGeometry,
  DirectionalLight,
  DoubleSide,
  EqualStencilFunc,
  Group,
  HemisphereLight,
  IncrementStencilOp,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  RingGeometry,
  Scene,
  SphereGeometry,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
  TorusGeometry,
  WebGLRenderer,
} from "./vendor/three.min.js";
import { html, themed } from "./elements.js";

const START = { azimuth: (-152 * Math.PI) / 180, elevation: (30 * Math.PI) / 180, zoom: 1 }; // as in the films
const DUCT = 0.5; // radius
const GROUND = -0.85;
const CIRCLE = 1.55; // on the ground
const LINE = [0.014, 0.03]; // its width: with smooth edges, and without, where a thin line has gaps
const SUN = [-1.6, -1.4, 5];
const HALF_VIEW = [1.97, 1.46]; // half the width and height that must be in the picture
const FIELD = Math.tan((14 * Math.PI) / 180); // half of the vertical field of view
const LONGEST = 1; // arrow that stays in the picture
const LEAST_FULL = 0.5; // share of the weight; the longest arrow is the largest thrust of the gait, or this
const TURNS = 12; // of the blades in one period

/** Return a cylinder along z. */
function cylinder(top, bottom, height, material, isOpen = false) {
  const shape = new CylinderGeometry(top, bottom, height, 32, 1, isOpen).rotateX(Math.PI / 2);
  return new Mesh(shape, material);
}

function placed(part, x, y, z) {
  part.position.set(x, y, z);
  return part;
}

/** Return the number of a rotor on a disc that always faces the viewer. */
function labelOf(number) {
  const canvas = html("canvas", { width: 128, height: 128 });
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map: texture, depthTest: false }));
  sprite.scale.setScalar(0.3);
  sprite.renderOrder = 2;
  sprite.paint = (color, panel, ink) => {
    const brush = canvas.getContext("2d");
    brush.clearRect(0, 0, 128, 128);
    brush.beginPath();
    brush.arc(64, 64, 52, 0, 2 * Math.PI);
    brush.fillStyle = panel;
    brush.fill();
    brush.lineWidth = 14;
    brush.strokeStyle = color;
    brush.stroke();
    brush.fillStyle = ink;
    brush.font = "600 66px system-ui, sans-serif";
    brush.textAlign = "center";
    brush.textBaseline = "middle";
    brush.fillText(number, 64, 69);
    texture.needsUpdate = true;
  };
  return sprite;
}

/** Return one rotor that tilts about x and thrusts along z at zero tilt, and what its posture is. */
function rotorOf(number, clockwise, frame) {
  const paint = new MeshLambertMaterial({ side: DoubleSide });
  const veil = new MeshBasicMaterial({ transparent: true, opacity: 0.3, side: DoubleSide, depthWrite: false });
  const glow = new MeshLambertMaterial({ emissiveIntensity: 0.35 });

  const blades = new Group();
  for (const side of [0, Math.PI]) {
    const blade = cylinder(0.075, 0.04, 0.4, frame);
    blade.rotation.set(0, Math.PI / 2, 0);
    blade.scale.set(0.12, 1, 1);
    const holder = new Group();
    holder.add(placed(blade, 0.22, 0, 0.03));
    holder.rotation.z = side;
    blades.add(holder);
  }

  const arrow = new Group();
  const shaft = new Mesh(new CylinderGeometry(0.035, 0.035, 1, 16).rotateX(Math.PI / 2).translate(0, 0, 0.5), glow);
  const head = new Mesh(new ConeGeometry(0.1, 0.26, 24).rotateX(Math.PI / 2).translate(0, 0, 0.13), glow);
  arrow.add(shaft, head);

  const lip = new Mesh(new TorusGeometry(DUCT, 0.03, 8, 48), paint);
  const wall = cylinder(DUCT, DUCT - 0.03, 0.16, paint, true);
  const strut = placed(new Mesh(new CylinderGeometry(0.03, 0.03, 2 * DUCT, 12), frame), 0, 0, -0.05);
  const tilting = new Group();
  tilting.add(
    placed(lip, 0, 0, 0.08),
    wall,
    placed(new Mesh(new CircleGeometry(DUCT - 0.02, 48), veil), 0, 0, 0.04),
    strut,
    placed(cylinder(0.07, 0.09, 0.16, frame), 0, 0, -0.02),
    placed(blades, 0, 0, 0.03),
    arrow,
  );
  const label = labelOf(String(number));
  const whole = new Group();
  whole.add(tilting);
  return {
    whole,
    label,
    color(color, panel, ink) {
      for (const material of [paint, veil, glow]) material.color.set(color);
      glow.emissive.set(color);
      label.paint(color, panel, ink);
    },
    /** Tilt by an angle [rad], with a thrust as a share of the weight, or null where there is none; `most` of all. */
    pose(alpha, share, phase, most) {
      tilting.rotation.x = alpha;
      blades.rotation.z = (clockwise ? -1 : 1) * 2 * Math.PI * TURNS * phase;
      const length = (LONGEST * Math.abs(share ?? 0)) / Math.max(LEAST_FULL, most);
      arrow.visible = length > 0.01;
      arrow.rotation.x = share < 0 ? Math.PI : 0;
      shaft.scale.z = Math.max(0.01, length - 0.2);
      head.position.z = Math.max(0, length - 0.2);
      head.scale.setScalar(Math.min(1, length / 0.3));
    },
  };
}

/**
 * Make the picture in `root` with a WebGL2 context that `canvas` has already given.
 *
 * At least `pause` [ms] pass from one picture to the next. `onLost` is called when the browser takes the context away.
 */
export function sceneIn(root, canvas, context, pause, onLost) {
  const renderer = new WebGLRenderer({ canvas, context, alpha: true, stencil: true });
  renderer.setPixelRatio(pause ? 1 : Math.min(2, window.devicePixelRatio || 1));
  const scene = new Scene();
  const camera = new PerspectiveCamera((2 * Math.atan(FIELD) * 180) / Math.PI, 1, 0.5, 60);
  camera.up.set(0, 0, 1);
  let view = { ...START };
  let model = null;
  let rotors = [];
  let posture = null;
  let size = "";
  let asked = 0;
  let painted = -Infinity;
  let visible = true;
  let resting = false;

  const sky = new HemisphereLight(0xffffff, 0x8a8f98, 1.7);
  sky.position.set(0, 0, 1);
  const sun = placed(new DirectionalLight(0xffffff, 2.1), ...SUN);
  const rule = new MeshBasicMaterial({ transparent: true, opacity: 0.4, depthWrite: false });
  const circle = placed(new Mesh(new RingGeometry(CIRCLE - LINE[pause ? 1 : 0], CIRCLE, 96), rule), 0, 0, GROUND);
  scene.add(sky, sun, circle);

  // The shadow is the vehicle's outline pressed onto the ground; no pixel of it is darkened twice.
  const shade = new MeshBasicMaterial({ color: 0x000000, transparent: true, depthWrite: false, side: DoubleSide });
  Object.assign(shade, { stencilWrite: true, stencilFunc: EqualStencilFunc, stencilZPass: IncrementStencilOp });
  const [toX, toY] = [SUN[0] / SUN[2], SUN[1] / SUN[2]];
  const press = new Matrix4().set(1, 0, -toX, toX * GROUND, 0, 1, -toY, toY * GROUND, 0, 0, 0, GROUND, 0, 0, 0, 1);
  const shadow = new Group();
  shadow.matrixAutoUpdate = false;
  shadow.matrix.copy(press);
  scene.add(shadow);

  const frame = new MeshLambertMaterial();
  const body = new MeshLambertMaterial();

  /** Return a strip of shadow, as long as it is along x and y. */
  const blot = (alongY, alongX) => new Mesh(new PlaneGeometry(alongX, alongY), shade);

  function build({ places, frames, clockwise }) {
    model?.traverse((part) => part.geometry?.dispose());
    model?.removeFromParent();
    shadow.clear();
    model = new Group();
    rotors = places.map(([x, y, z], k) => {
      const rotor = rotorOf(k + 1, clockwise[k], frame);
      const axes = new Matrix4().set(...frames[k].flatMap((row) => [...row, 0]), 0, 0, 0, 1);
      const reach = Math.hypot(x, y);
      const bearing = Math.atan2(y, x);
      const arm = new Mesh(new CylinderGeometry(0.04, 0.055, reach, 20).rotateZ(-Math.PI / 2), frame);
      arm.rotation.z = bearing;
      placed(rotor.whole, x, y, z).setRotationFromMatrix(axes);
      const away = 1 + 0.7 / reach;
      model.add(placed(arm, x / 2, y / 2, z), placed(rotor.label, away * x, away * y, z));
      rotor.shadow = new Group();
      rotor.shadow.add(new Mesh(new RingGeometry(DUCT - 0.045, DUCT + 0.02, 48), shade), blot(2 * DUCT, 0.06));
      const below = new Group();
      placed(below, x, y, 0).setRotationFromMatrix(axes);
      below.add(rotor.shadow);
      const strip = placed(blot(0.09, reach), x / 2, y / 2, 0);
      strip.rotation.z = bearing;
      shadow.add(below, strip);
      return rotor;
    });
    const height = places.reduce((sum, [, , z]) => sum + z / 4, 0);
    const hub = cylinder(0.25, 0.29, 0.16, body);
    const dome = placed(new Mesh(new SphereGeometry(0.25, 32, 8, 0, 2 * Math.PI, 0, Math.PI / 2), body), 0, 0, 0.08);
    dome.rotation.x = Math.PI / 2;
    dome.scale.set(1, 0.45, 1);
    shadow.add(new Mesh(new CircleGeometry(0.28, 32), shade));
    const mast = placed(cylinder(0.06, 0.06, Math.max(Math.abs(height), 0.01), frame), 0, 0, height / 2);
    mast.visible = height !== 0; // from the centre of mass to the arms
    // An arrow on the ground points forward.
    const forward = placed(new Mesh(new CircleGeometry(0.2, 3), rule), CIRCLE + 0.1, 0, GROUND);
    model.add(hub, dome, mast, forward, ...rotors.map((rotor) => rotor.whole));
    scene.add(model);
    recolor();
  }

  function recolor() {
    const [panel, ink, page] = ["--panel", "--ink", "--page"].map(themed);
    const isDark = new Color(page).getHSL({}).l < 0.5;
    rotors.forEach((rotor, k) => rotor.color(themed(`--alpha${k + 1}`), panel, ink));
    frame.color.set(isDark ? "#8d949f" : "#5a616c");
    body.color.set(isDark ? "#b9bfc8" : "#3d434c");
    rule.color.set(ink);
    shade.opacity = isDark ? 0.45 : 0.16;
    draw();
  }

  function aim() {
    const { clientWidth: width, clientHeight: height } = root;
    if (!width || !height) return false;
    if (size !== `${width} ${height}`) {
      size = `${width} ${height}`;
      renderer.setSize(width, height, false); // clears the picture and its memory
    }
    camera.aspect = width / height;
    const away = Math.max(HALF_VIEW[0] / camera.aspect, HALF_VIEW[1]) / FIELD / view.zoom;
    const level = away * Math.cos(view.elevation);
    camera.position.set(
      level * Math.cos(view.azimuth),
      level * Math.sin(view.azimuth),
      away * Math.sin(view.elevation),
    );
    camera.lookAt(0, 0, -0.36);
    camera.updateProjectionMatrix();
    return true;
  }

  function paint(now) {
    asked = 0;
    if (!visible || resting || !model || !aim()) return;
    if (now - painted < pause) {
      draw();
      return;
    }
    painted = now;
    if (posture) {
      rotors.forEach((rotor, k) => {
        rotor.pose(posture.alpha[k], posture.shares[k], posture.phase, posture.most);
        rotor.shadow.rotation.x = posture.alpha[k];
      });
    }
    renderer.render(scene, camera);
  }

  function draw() {
    asked ||= requestAnimationFrame(paint);
  }

  function turn(azimuth, elevation) {
    view.azimuth += azimuth;
    view.elevation = Math.min(1.55, Math.max(-0.05, view.elevation + elevation));
    draw();
  }

  function zoom(factor) {
    view.zoom = Math.min(3, Math.max(0.6, view.zoom * factor));
    draw();
  }

  function reset() {
    view = { ...START };
    draw();
  }

  let last = null;
  canvas.addEventListener("pointerdown", (event) => {
    last = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!last || !event.buttons) return;
    turn((last[0] - event.clientX) / 110, (event.clientY - last[1]) / 110);
    last = [event.clientX, event.clientY];
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, () => (last = null));
  canvas.addEventListener("dblclick", reset);
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey) return; // the page scrolls; a pinch on a touchpad comes with the key
      event.preventDefault();
      zoom(Math.exp(-event.deltaY / 100));
    },
    { passive: false },
  );
  const KEYS = {
    ArrowLeft: () => turn(-0.15, 0),
    ArrowRight: () => turn(0.15, 0),
    ArrowUp: () => turn(0, 0.1),
    ArrowDown: () => turn(0, -0.1),
    "+": () => zoom(1.15),
    "-": () => zoom(1 / 1.15),
    0: reset,
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in KEYS) || event.ctrlKey || event.metaKey || event.altKey) return;
    KEYS[event.key]();
    event.preventDefault();
  });
  canvas.addEventListener("webglcontextlost", onLost);
  new ResizeObserver(draw).observe(root);
  new IntersectionObserver((entries) => {
    visible = entries.at(-1).isIntersecting;
    if (visible) draw();
  }).observe(canvas);

  return {
    build,
    recolor,
    rest(wanted) {
      resting = wanted;
      if (!resting) draw();
    },
    /** Show tilt angles [rad] and thrusts as shares of the weight, the largest of which is `most`, at a phase. */
    pose(next) {
      posture = next;
      draw();
    },
  };
}
