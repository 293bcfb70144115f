// The canvas: camera, clouds and lines, drawn when something has changed.
import { CloudPoints } from "./cloud_points.js";
import { Detail } from "./detail.js";
import { MatchLines } from "./match_lines.js";
import {
  OrbitControls,
  PerspectiveCamera,
  Quaternion,
  Scene,
  Sphere,
  Spherical,
  Vector3,
  WebGLRenderer,
} from "./three.js";

const REST_MS = 180; // without a change, until all points are drawn again
const MOST_PIXELS_PER_CSS_PIXEL = 2;

export class Stage {
  /// Throws where the browser has no WebGL.
  constructor(canvas, pair, frame) {
    this.canvas = canvas;
    this.frame = frame;
    this.renderer = new WebGLRenderer({ canvas, antialias: false, alpha: false });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(40, 1, 0.01, 200);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.changed());
    this.controls.addEventListener("start", () => (this.follows = false));
    this.makeClouds(pair);
    this.detail = new Detail(this.clouds.source.count + this.clouds.target.count);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.sourceMiddle = new Vector3();
    this.resize();
    this.lookFrom();
  }

  /// `ghost` is the source as it was given; the described points lie on both clouds.
  makeClouds(pair) {
    const { source, target, explanation: e } = pair;
    this.clouds = {
      ghost: new CloudPoints(source.xyz),
      target: new CloudPoints(target.xyz),
      source: new CloudPoints(source.xyz),
    };
    if (e !== null) {
      this.clouds.describedTarget = new CloudPoints(e.target.xyz);
      this.clouds.describedSource = new CloudPoints(e.source.xyz);
      for (const [name, d] of [["describedTarget", e.target], ["describedSource", e.source]]) {
        this.clouds[name].setValues(Uint8Array.from(d.significance, (s) => Math.round(255 * s)));
      }
    }
    const still = this.frame.matrix({ turn: new Quaternion(), middle: new Vector3() });
    this.clouds.target.place(still);
    this.clouds.describedTarget?.place(still);
    this.clouds.ghost.place(this.frame.matrix(this.frame.start));
    this.lines = e === null ? null : new MatchLines(e, this.frame, still);
    for (const cloud of this.all()) this.scene.add(cloud.object);
    if (this.lines !== null) this.scene.add(this.lines.object);
  }

  all() {
    return Object.values(this.clouds);
  }

  /// Puts the source at a place (frame.js).
  placeSource(place) {
    const matrix = this.frame.matrix(place);
    for (const moving of [this.clouds.source, this.clouds.describedSource, this.lines]) {
      moving?.place(matrix);
    }
    this.sourceMiddle = place.middle;
    if (this.follows) this.fit();
    this.changed();
  }

  /// As it is first seen. Until the reader moves the camera, it keeps all in the picture.
  lookFrom() {
    this.follows = true;
    this.camera.position.set(0.45, 0.35, 1);
    this.controls.target.set(0, 0, 0);
    this.fit();
    this.changed();
  }

  /// Moves the camera so that both clouds fill the picture; it keeps its direction.
  fit() {
    const middles = [new Vector3(), this.sourceMiddle];
    if (this.clouds.ghost.object.visible) middles.push(this.frame.start.middle);
    const ball = new Sphere().setFromPoints(middles);
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    const angle = (this.camera.fov / 2) * (Math.PI / 180);
    const distance = (ball.radius + 1.05) / Math.sin(angle) / Math.min(1, this.camera.aspect);
    this.controls.target.copy(ball.center);
    this.camera.position.copy(ball.center).addScaledVector(direction, distance);
    this.controls.update();
  }

  /// Turns the camera about what it looks at, in degrees.
  orbit(sideways, upwards) {
    this.follows = false;
    const degrees = Math.PI / 180;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const at = new Spherical().setFromVector3(offset);
    at.theta += sideways * degrees;
    at.phi -= upwards * degrees;
    at.makeSafe();
    this.camera.position.setFromSpherical(at).add(this.controls.target);
    this.controls.update();
    this.changed();
  }

  /// Changes the distance by a factor.
  zoom(factor) {
    this.follows = false;
    const offset = this.camera.position.clone().sub(this.controls.target);
    this.camera.position.copy(this.controls.target).addScaledVector(offset, factor);
    this.controls.update();
    this.changed();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXELS_PER_CSS_PIXEL));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    if (this.follows) this.fit();
    this.changed();
  }

  /// Asks for a frame; with what can be drawn fluently until nothing has changed for a while.
  changed() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.rest(), REST_MS);
    this.wanted ??= requestAnimationFrame((now) => {
      this.wanted = null;
      this.detail.frame(now);
      this.draw(this.detail.share);
    });
  }

  rest() {
    this.detail.rest();
    this.draw(1);
  }

  draw(share) {
    for (const cloud of this.all()) cloud.setShare(share);
    this.renderer.render(this.scene, this.camera);
  }
}
