// Numbers and names as the panel shows them.

export const number = (value, digits = 3) =>
  value === null ? "not known" : String(Number(value.toPrecision(digits)));

export const percent = (value) => (value === null ? "not known" : `${Math.round(100 * value)} %`);

export const milliseconds = (ms) => `${ms.toFixed(ms < 10 ? 2 : 1)} ms`;

/// The last part of a path.
export const fileName = (path) => path.split(/[\\/]/).filter(Boolean).pop() ?? path;

/// What a status means, for people.
export const statusText = {
  ok: "aligned",
  low_confidence: "not sure: more likely wrong than right",
  ambiguous: "ambiguous: another pose fits as well",
  scales_differ: "the clouds' sizes differ: other units?",
  timed_out: "the time budget was spent: nothing has judged the pose",
  too_few_points: "no pose: too few points",
  not_finite: "no pose: coordinates that are not finite",
  degenerate: "no pose: the points determine no rotation",
  cancelled: "no pose: cancelled",
};

export const kindText = {
  answer: "answer",
  alternative: "alternative",
  hypothesis: "hypothesis",
  coarse: "global register",
};

/// The angle in degrees between the rotations of two poses (16 numbers, row-major).
export function angleBetween(a, b) {
  let squared = 0;
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) {
      squared += (a[4 * row + column] - b[4 * row + column]) ** 2;
    }
  }
  return (2 * Math.asin(Math.min(1, Math.sqrt(squared / 8))) * 180) / Math.PI;
}
