// The page's state, and what follows from it: the picture, the panel, the controls.
import { showLegend } from "./legend.js";
import { Motion } from "./motion.js";
import { markPose, showFacts, showPoses, showTimes } from "./panel.js";
import { Residuals } from "./residuals.js";
import { Stage } from "./stage.js";
import { Theme } from "./theme.js";

const $ = (id) => document.getElementById(id);
const SLIDER_STEPS = 1000;

export class Page {
  constructor(pair, frame) {
    this.pair = pair;
    this.frame = frame;
    this.colour = "plain";
    this.shown = { source: true, target: true, ghost: false, matches: false };
    this.residuals = new Residuals(pair, frame);
    this.theme = new Theme(() => this.paint());
    this.motion = new Motion(frame, pair.poses, () => this.moved());
    this.stage = this.makeStage();
    showFacts(pair, frame);
    showPoses(pair, (i) => this.choose(i));
    showTimes(pair.result.ms);
    this.wireControls();
    this.disableWhatIsNotThere();
    markPose(0);
    this.paint();
    this.moved();
  }

  /// Null without WebGL: the panel is of use without the picture.
  makeStage() {
    try {
      return new Stage($("canvas"), this.pair, this.frame);
    } catch {
      $("no-webgl").hidden = false;
      return null;
    }
  }

  wireControls() {
    $("slider").addEventListener("input", () => {
      this.motion.setShare(Number($("slider").value) / SLIDER_STEPS);
    });
    $("play").addEventListener("click", () => this.motion.togglePlay());
    $("theme").addEventListener("click", () => this.theme.toggle());
    $("reset").addEventListener("click", () => this.stage?.lookFrom());
    for (const input of document.querySelectorAll("input[name=colour]")) {
      input.addEventListener("change", () => this.setColour(input.value));
    }
    for (const name of Object.keys(this.shown)) {
      $(`show-${name}`).addEventListener("change", () => this.toggle(name));
    }
  }

  disableWhatIsNotThere() {
    const { explanation, poses } = this.pair;
    $("slider").disabled = $("play").disabled = poses.length === 0;
    $("colour-residual").disabled = poses.length === 0;
    $("colour-significance").disabled = !explanation?.source.significance.length;
    $("show-matches").disabled = !explanation?.matches.weight.length;
  }

  choose(index) {
    if (this.pair.poses[index] === undefined) return;
    this.motion.choose(index);
    markPose(index);
    this.measure();
  }

  chooseNext(step) {
    const count = this.pair.poses.length;
    if (count > 0) this.choose((this.motion.index + step + count) % count);
  }

  setColour(colour) {
    if ($(`colour-${colour}`).disabled) return;
    $(`colour-${colour}`).checked = true;
    this.colour = colour;
    this.paint();
    this.measure();
  }

  toggle(name) {
    if ($(`show-${name}`).disabled) return;
    this.shown[name] = !this.shown[name];
    $(`show-${name}`).checked = this.shown[name];
    this.paint();
  }

  /// After the source has moved.
  moved() {
    const { share, playing } = this.motion;
    const slider = $("slider");
    slider.value = String(Math.round(SLIDER_STEPS * share));
    const words = share === 0 ? "before" : share === 1 ? "after" : `${Math.round(100 * share)} % of the way`;
    slider.setAttribute("aria-valuetext", words);
    $("play").setAttribute("aria-pressed", String(playing));
    $("play").textContent = playing ? "❚❚ Pause" : "▶ Play";
    this.stage?.placeSource(this.motion.place);
  }

  /// Colours, sizes and what is visible.
  paint() {
    showLegend(this.colour, this.residuals.most);
    $("theme").textContent = this.theme.dark ? "☀ Light" : "☾ Dark";
    if (this.stage === null) return;
    const { clouds, lines, renderer } = this.stage;
    const significance = this.colour === "significance";
    const colour = (name) => this.theme.colour(name);
    const scale = significance ? "significance" : "residual";
    const shared = { paper: colour("paper") };
    for (const step of ["low", "mid", "high"]) shared[step] = colour(`${scale}-${step}`);
    renderer.setClearColor(colour("paper"));
    for (const [name, cloud] of Object.entries(clouds)) {
      const side = /source/i.test(name) ? "source" : name;
      cloud.setColours({ ...shared, plain: colour(side === "describedTarget" ? "target" : side) });
      cloud.uniforms.size.value = this.pointSize(cloud.count);
      cloud.uniforms.fade.value = significance ? 0.7 : 0;
    }
    if (this.colour !== "residual") {
      for (const name of ["source", "target", "ghost"]) clouds[name].setValues(null);
    }
    for (const name of ["source", "target", "ghost"]) clouds[name].object.visible = this.shown[name];
    for (const [name, side] of [["describedSource", "source"], ["describedTarget", "target"]]) {
      if (clouds[name] === undefined) continue;
      clouds[name].object.visible = significance && this.shown[side];
      clouds[name].uniforms.size.value = 5 * renderer.getPixelRatio();
      clouds[name].uniforms.fade.value = 0;
    }
    if (lines !== null) {
      lines.setColours({ agree: colour("agree"), differ: colour("differ") });
      lines.object.visible = this.shown.matches;
      this.markMatches();
    }
    if (this.stage.follows) this.stage.fit();
    this.stage.changed();
  }

  /// Pixels: larger where a cloud has few points.
  pointSize(count) {
    return (count > 20000 ? 1.5 : count > 4000 ? 2 : 3) * this.stage.renderer.getPixelRatio();
  }

  /// Colours the lines by whether the chosen pose brings their ends together.
  markMatches() {
    const end = this.motion.ends[this.motion.index];
    const { lines } = this.stage;
    if (end === undefined || lines.count === 0) return;
    const limit = this.residuals.most / this.frame.size;
    const number = lines.mark(this.frame.matrix(end), limit);
    $("matches-count").textContent = `(${number} of ${lines.count} agree)`;
  }

  /// Residuals at the chosen pose, if they are wanted.
  async measure() {
    if (this.stage === null) return;
    if (this.stage.lines !== null) this.markMatches();
    if (this.colour !== "residual") return;
    const { index } = this.motion;
    const wanted = () => this.colour === "residual" && this.motion.index === index;
    const values = await this.residuals.measure(this.motion.ends[index], wanted);
    if (values === null || !wanted()) return;
    this.stage.clouds.source.setValues(values[0]);
    this.stage.clouds.ghost.setValues(values[0]);
    this.stage.clouds.target.setValues(values[1]);
    this.stage.changed();
  }
}
