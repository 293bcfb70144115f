// Starts the page. `vnregViewer` is for scripts and tests around it (docs/viewer.md).
import { Frame } from "./frame.js";
import { listenToKeys } from "./keys.js";
import { Page } from "./page.js";
import { readPair } from "./pair_data.js";

const pair = readPair(document.getElementById("pair").textContent);
const page = new Page(pair, new Frame(pair));
listenToKeys(document.getElementById("canvas"), page);

/// Column-major 4x4 numbers: where the source is now, from its middle and units to the scene.
const sourceMatrix = () => page.frame.matrix(page.motion.place).toArray();

globalThis.vnregViewer = {
  state: () => ({
    pose: page.motion.index,
    share: page.motion.share,
    playing: page.motion.playing,
    colour: page.colour,
    shown: { ...page.shown },
    dark: page.theme.dark,
    drawn: page.stage?.detail.share ?? 0,
    sourceMatrix: sourceMatrix(),
    camera: page.stage?.camera.position.toArray() ?? null,
  }),
  setShare: (share) => page.motion.setShare(share),
  choosePose: (index) => page.choose(index),
  orbit: (sideways, upwards) => page.stage?.orbit(sideways, upwards),
  drawAll: () => page.stage?.rest(),
};
