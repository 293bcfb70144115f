// How many of the points are drawn while the view moves: as many as keep it fluent. When it rests,
// all are.

const SLOW_MS = 29; // between two frames: 34 frames per second
const FAST_MS = 25;
const FEWEST = 10000; // points, of both clouds together

export class Detail {
  constructor(points) {
    this.least = Math.min(1, FEWEST / Math.max(points, 1));
    this.share = 1;
    this.rest();
  }

  /// Takes the time of a frame while the view moves.
  frame(now) {
    if (this.last !== null) this.adapt(Math.min(now - this.last, 3 * SLOW_MS));
    this.last = now;
  }

  /// Goes by a running mean of the times, so that one long frame changes little.
  adapt(ms) {
    this.mean = this.mean === null ? ms : this.mean + 0.2 * (ms - this.mean);
    if (this.mean > 2 * SLOW_MS) {
      this.share *= 0.5;
      this.mean = null; // what was is of no interest now
    } else if (this.mean > SLOW_MS) {
      this.share *= 0.95;
    } else if (this.mean < FAST_MS) {
      this.share *= 1.02;
    }
    this.share = Math.min(1, Math.max(this.least, this.share));
  }

  /// The view has come to rest: the time until the next frame says nothing.
  rest() {
    this.last = null;
    this.mean = null;
  }
}
