// Angles as a researcher writes them: multiples of π where they are such, radians otherwise. No planning here.

export const HALF_PI = Math.PI / 2;
// Those of grids and of whole degrees
const DENOMINATORS = [1, 2, 3, 4, 5, 6, 8, 9, 10, 12, 16, 18, 20, 24, 30, 32, 36, 45, 48, 60, 64, 90, 96, 128, 180];
const ROUGH = [1, 2, 3, 4, 6, 8, 12, 16];

/** Return [n, d] with x = nπ/d, n whole and d one of the denominators, or null. Exact if tolerance is 0. */
function multipleOfPi(x, tolerance = 1e-9, denominators = DENOMINATORS) {
  for (const d of denominators) {
    const n = Math.round((x * d) / Math.PI);
    if (Math.abs((n * Math.PI) / d - x) <= tolerance) return [n, d];
  }
  return null;
}

/** Return a number with a true minus sign. */
export function number(x, digits = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  return x.toFixed(digits).replace("-", "−");
}

/** Return a number with so many significant digits, without trailing zeros and with a true minus sign. */
export function figure(x, digits = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  const text =
    x !== 0 && Math.abs(x) < 1e-3
      ? x.toExponential(digits - 1).replace(/\.?0*e/, "e")
      : String(Number(x.toPrecision(digits)));
  return text.replaceAll("-", "−");
}

const multiple = ([n, d]) => {
  if (n === 0) return "0";
  const head = `${n < 0 ? "−" : ""}${Math.abs(n) === 1 ? "" : Math.abs(n)}π`;
  return d === 1 ? head : `${head}/${d}`;
};

/** Return "−3π/8", or radians with four digits where there is no such multiple. */
export function angle(x) {
  if (x === null || x === undefined) return "–";
  const found = multipleOfPi(x);
  return found ? multiple(found) : number(x);
}

/** Return a message of the server with the angles of its points, such as "(1.1781, -0.3927)", as on the map, and true minus signs. */
export function inPi(text) {
  return text.replace(/\((-?\d\.\d{3,}(?:, -?\d\.\d{3,})+)\)/g, (_, angles) => {
    const shown = angles.split(", ").map((digits) => {
      const places = digits.split(".")[1].length;
      const found = multipleOfPi(Number(digits), 0.6 * 10 ** -places, ROUGH);
      return found ? multiple(found) : number(Number(digits), Math.min(4, places));
    });
    return `(${shown.join(", ")})`;
  }).replace(/-(?=\d)/g, "−");
}

/** Return the text that stands for exactly this number in an address: "-3pi/8" or all its digits. */
export function exactText(x) {
  const found = multipleOfPi(x, 0);
  if (!found || found[0] === 0) return String(x === 0 ? 0 : x);
  return multiple(found).replace("−", "-").replace("π", "pi");
}

/** Return the angle that a text names ("3pi/8", "-3*π/8", "67.5deg", "1.178"), or null. */
export function angleFromText(text) {
  const plain = text.trim().toLowerCase().replaceAll("−", "-").replaceAll("π", "pi").replaceAll(" ", "");
  const parts = /^([+-]?)(\d+(?:\.\d+)?)?\*?pi(?:\/(\d+))?$/.exec(plain);
  if (parts) {
    const [, sign, factor = 1, divisor = 1] = parts;
    const value = (Number(`${sign}${factor}`) * Math.PI) / Number(divisor);
    return Number.isFinite(value) ? value : null;
  }
  const degrees = /^([+-]?\d+(?:\.\d+)?)(?:deg|°)$/.exec(plain);
  if (degrees) return tidied((Number(degrees[1]) * Math.PI) / 180);
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/.test(plain) ? Number(plain) : null;
}

/** Return exactly the multiple of π that x is but for rounding, or x itself where it is none. */
export function tidied(x) {
  const found = multipleOfPi(x);
  return found ? (found[0] * Math.PI) / found[1] : x;
}

/** Return x kept within [−π/2, π/2]. */
export function clamped(x) {
  return Math.min(HALF_PI, Math.max(-HALF_PI, x));
}

/** Return the nearest multiple of π/16, the paper's grid. */
export function snapped(x) {
  return clamped((Math.round((x * 16) / Math.PI) * Math.PI) / 16);
}
