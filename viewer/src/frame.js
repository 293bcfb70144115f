// The scene's frame: the middle of the target is its origin, the clouds' size is 1. Everything is
// computed in doubles before the graphics card sees it as float32.
import { Matrix4, Quaternion, Vector3 } from "./three.js";

const FARTHEST_START = 3; // sizes; a source that lies farther away is shown so near

/// The distance from the middle that 98 % of the points (x, y, z, x, ...) keep.
function reach(xyz) {
  const step = Math.max(1, Math.floor(xyz.length / 3 / 20000));
  const distances = [];
  for (let i = 0; i + 2 < xyz.length; i += 3 * step) {
    distances.push(Math.hypot(xyz[i], xyz[i + 1], xyz[i + 2]));
  }
  distances.sort((a, b) => a - b);
  return distances[Math.floor(0.98 * (distances.length - 1))] ?? 0;
}

export class Frame {
  constructor(pair) {
    this.size = Math.max(reach(pair.source.xyz), reach(pair.target.xyz)) || 1;
    this.sourceOrigin = pair.source.origin;
    this.targetOrigin = pair.target.origin;
    const apart = new Vector3(...pair.source.origin.map((v, i) => v - pair.target.origin[i]));
    this.startDistance = apart.length();
    apart.divideScalar(this.size);
    this.startIsNearer = apart.length() > FARTHEST_START;
    if (this.startIsNearer) apart.setLength(FARTHEST_START);
    /// Where the source is as it was given.
    this.start = { turn: new Quaternion(), middle: apart };
  }

  /// Where a pose (16 numbers, row-major) puts the source: its turn, and the place of its middle.
  place(pose) {
    const m = new Matrix4().set(...pose);
    const middle = new Vector3(...this.sourceOrigin).applyMatrix4(m);
    middle.sub(new Vector3(...this.targetOrigin)).divideScalar(this.size);
    return { turn: new Quaternion().setFromRotationMatrix(m), middle };
  }

  /// From points about the source's middle, in its units, to the scene.
  matrix({ turn, middle }) {
    const scale = new Vector3().setScalar(1 / this.size);
    return new Matrix4().compose(middle, turn, scale);
  }
}

/// The part `share`, 0 to 1, of the way from one place to another: the middle goes straight while
/// the body turns about it.
export function between(from, to, share) {
  return {
    turn: from.turn.clone().slerp(to.turn, share),
    middle: from.middle.clone().lerp(to.middle, share),
  };
}
