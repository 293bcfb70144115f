// A cloud as three.js draws it: points in one colour, or coloured by a value of each.
import { BufferAttribute, BufferGeometry, Color, Points, ShaderMaterial } from "./three.js";

// The value's colours run from `low` over `mid` to `high`. What is far away is drawn paler.
const vertexShader = `
  uniform vec3 plain, low, mid, high, paper;
  uniform float size, valued, fade;
  attribute float value;
  varying vec3 colour;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * seen;
    gl_PointSize = size;
    vec3 of_value = value < 0.5 ? mix(low, mid, 2.0 * value) : mix(mid, high, 2.0 * value - 1.0);
    float depth = clamp((-seen.z / length(cameraPosition) - 0.6) * 0.7, 0.0, 0.5);
    colour = mix(mix(plain, of_value, valued), paper, max(depth, fade));
  }`;

const fragmentShader = `
  varying vec3 colour;
  void main() { gl_FragColor = vec4(colour, 1.0); }`;

function makeMaterial() {
  const colour = () => ({ value: new Color() });
  const number = (value) => ({ value });
  return new ShaderMaterial({
    vertexShader,
    fragmentShader,
    uniforms: {
      plain: colour(),
      low: colour(),
      mid: colour(),
      high: colour(),
      paper: colour(),
      size: number(2),
      valued: number(0),
      fade: number(0),
    },
  });
}

export class CloudPoints {
  /// xyz: about the cloud's middle, in its units.
  constructor(xyz) {
    this.count = xyz.length / 3;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(xyz, 3));
    geometry.setAttribute("value", new BufferAttribute(new Uint8Array(this.count), 1, true));
    this.object = new Points(geometry, makeMaterial());
    this.object.frustumCulled = false;
    this.object.matrixAutoUpdate = false;
  }

  get uniforms() {
    return this.object.material.uniforms;
  }

  /// colours: {plain, low, mid, high, paper}, as CSS says them.
  setColours(colours) {
    for (const [name, colour] of Object.entries(colours)) {
      // As they are: the shader writes them to the screen without conversion.
      this.uniforms[name].value.setStyle(colour, "srgb-linear");
    }
  }

  /// bytes: 0 to 255 per point; null: the plain colour for all.
  setValues(bytes) {
    this.uniforms.valued.value = bytes === null ? 0 : 1;
    if (bytes === null) return;
    const attribute = this.object.geometry.getAttribute("value");
    attribute.array.set(bytes);
    attribute.needsUpdate = true;
  }

  place(matrix) {
    this.object.matrix.copy(matrix);
  }

  /// Draws the first points only; any first ones are an even sample.
  setShare(share) {
    this.object.geometry.setDrawRange(0, Math.ceil(this.count * share));
  }
}
