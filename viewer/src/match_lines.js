// The matches as lines from the source's points, which move, to the target's, which do not.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  LineSegments,
  Matrix4,
  ShaderMaterial,
} from "./three.js";

// Both ends of a line are vertices: `moves` is 1 at the source's.
const vertexShader = `
  uniform mat4 motion, still;
  uniform vec3 agree, differ;
  attribute float moves, agrees, weight;
  varying vec4 colour;
  void main() {
    vec4 place = moves > 0.5 ? motion * vec4(position, 1.0) : still * vec4(position, 1.0);
    gl_Position = projectionMatrix * viewMatrix * place;
    colour = vec4(mix(differ, agree, agrees), 0.25 + 0.75 * weight);
  }`;

const fragmentShader = `
  varying vec4 colour;
  void main() { gl_FragColor = colour; }`;

/// One number per match, for both ends.
const forBothEnds = (values) => Float32Array.from({ length: 2 * values.length }, (_, i) => values[i >> 1]);

export class MatchLines {
  constructor(explanation, frame, targetMatrix) {
    const { ends, weight } = explanation.matches;
    this.ends = ends;
    this.count = weight.length;
    this.clouds = [explanation.source.xyz, explanation.target.xyz];
    const places = new Float32Array(3 * ends.length);
    for (let i = 0; i < ends.length; i++) {
      const from = 3 * ends[i];
      places.set(this.clouds[i % 2].subarray(from, from + 3), 3 * i);
    }
    this.places = places;
    const heaviest = weight.reduce((a, b) => Math.max(a, b), 0) || 1;
    const geometry = new BufferGeometry();
    const add = (name, array, size) => geometry.setAttribute(name, new BufferAttribute(array, size));
    add("position", places, 3);
    add("moves", Float32Array.from(ends, (_, i) => 1 - (i % 2)), 1);
    add("weight", forBothEnds(weight.map((w) => Math.sqrt(w / heaviest))), 1);
    add("agrees", new Float32Array(ends.length), 1);
    const uniforms = {
      motion: { value: new Matrix4() },
      still: { value: targetMatrix },
      agree: { value: new Color() },
      differ: { value: new Color() },
    };
    const material = new ShaderMaterial({ vertexShader, fragmentShader, uniforms, transparent: true });
    this.object = new LineSegments(geometry, material);
    this.object.frustumCulled = false;
  }

  setColours({ agree, differ }) {
    this.object.material.uniforms.agree.value.setStyle(agree, "srgb-linear");
    this.object.material.uniforms.differ.value.setStyle(differ, "srgb-linear");
  }

  place(matrix) {
    this.object.material.uniforms.motion.value.copy(matrix);
  }

  /// Marks the matches whose ends the matrix brings closer together than `limit` (scene units), and
  /// returns their number.
  mark(matrix, limit) {
    const agrees = this.object.geometry.getAttribute("agrees");
    const { still } = this.object.material.uniforms;
    let number = 0;
    const from = this.places;
    for (let i = 0; i < this.count; i++) {
      const a = transform(matrix.elements, from, 6 * i);
      const b = transform(still.value.elements, from, 6 * i + 3);
      const near = Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < limit;
      agrees.array.fill(near ? 1 : 0, 2 * i, 2 * i + 2);
      number += near ? 1 : 0;
    }
    agrees.needsUpdate = true;
    return number;
  }
}

/// The point at xyz[at...] by a column-major 4x4 matrix.
function transform(m, xyz, at) {
  const [x, y, z] = [xyz[at], xyz[at + 1], xyz[at + 2]];
  return [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
}
