// How far each shown point of both clouds is from the other cloud at a pose.
import { NearestPoints } from "./nearest.js";
import { Matrix4, Vector3 } from "./three.js";

const POINTS_AT_A_TIME = 4000; // some 10 ms, so that the page stays responsive

const pause = () => new Promise((resolve) => setTimeout(resolve));

export class Residuals {
  constructor(pair, frame) {
    this.frame = frame;
    this.clouds = [pair.source.xyz, pair.target.xyz];
    this.trees = [null, null];
    /// The residual from which on all look alike, in units of the clouds.
    this.most = 3 * pair.result.inlier_distance || 0.1 * frame.size;
  }

  /// Shares of `most` as bytes, [source, target], for the source at a place (frame.place());
  /// null if `wanted()` has become false meanwhile.
  async measure(place, wanted) {
    const toTarget = this.frame.matrix(place);
    toTarget.premultiply(new Matrix4().makeScale(...Array(3).fill(this.frame.size)));
    const moves = [toTarget, toTarget.clone().invert()];
    const result = [];
    for (let side = 0; side < 2; side++) {
      this.trees[1 - side] ??= new NearestPoints(this.clouds[1 - side]);
      const bytes = await this.measureSide(side, moves[side], wanted);
      if (bytes === null) return null;
      result.push(bytes);
    }
    return result;
  }

  async measureSide(side, move, wanted) {
    const xyz = this.clouds[side];
    const bytes = new Uint8Array(xyz.length / 3);
    const point = new Vector3();
    for (let i = 0; i < bytes.length; i++) {
      if (i % POINTS_AT_A_TIME === 0) {
        await pause();
        if (!wanted()) return null;
      }
      point.fromArray(xyz, 3 * i).applyMatrix4(move);
      const distance = this.trees[1 - side].distance(point.x, point.y, point.z, this.most);
      bytes[i] = Math.round((255 * distance) / this.most);
    }
    return bytes;
  }
}
