// Where the source is: on its way from its start to the chosen pose. What changes by itself (play,
// the change to another pose) changes here, frame by frame.
import { between } from "./frame.js";

const PLAY_MS = 2400; // there
const SWITCH_MS = 500;

const eased = (share) => share * share * (3 - 2 * share);
const calm = matchMedia("(prefers-reduced-motion: reduce)");

export class Motion {
  /// onChange(motion) is called after every change.
  constructor(frame, poses, onChange) {
    this.frame = frame;
    this.ends = poses.map((p) => frame.place(p.pose));
    this.onChange = onChange;
    this.index = 0; // of the chosen pose
    this.share = poses.length > 0 ? 1 : 0; // of the way to it
    this.end = this.ends[0] ?? frame.start; // where the way ends: while poses change, between them
    this.playing = false;
  }

  get place() {
    return between(this.frame.start, this.end, this.share);
  }

  setShare(share) {
    this.stop();
    this.share = share;
    this.onChange(this);
  }

  /// Goes to another pose, at the same part of the way; to its end from the start.
  choose(index) {
    this.stop();
    this.index = index;
    const from = this.share === 0 ? this.frame.start : this.end;
    if (this.share === 0) this.share = 1;
    this.run(SWITCH_MS, (share) => {
      this.end = between(from, this.ends[index], share);
    });
  }

  /// There from the start, or on from where it is; stops if it is playing.
  togglePlay() {
    if (this.playing) {
      this.stop();
      this.onChange(this);
      return;
    }
    this.end = this.ends[this.index] ?? this.frame.start;
    const begin = this.share === 1 ? 0 : this.share;
    this.run(PLAY_MS * (1 - begin), (share) => {
      this.share = begin + (1 - begin) * share;
    });
    this.playing = this.request !== undefined;
    this.onChange(this);
  }

  stop() {
    cancelAnimationFrame(this.request);
    this.request = undefined;
    this.playing = false;
    this.end = this.ends[this.index] ?? this.frame.start;
  }

  /// Calls step(0...1) over the time; at once where the reader wants no motion.
  run(ms, step) {
    const begin = performance.now();
    const next = (now) => {
      const share = calm.matches ? 1 : Math.min(1, Math.max(0, (now - begin) / ms));
      step(eased(share));
      if (share === 1) this.stop();
      else this.request = requestAnimationFrame(next);
      this.onChange(this);
    };
    if (calm.matches) next(begin);
    else this.request = requestAnimationFrame(next);
  }
}
