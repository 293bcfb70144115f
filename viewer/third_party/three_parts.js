// What the viewer uses of three.js; make_three.sh bundles these and what they need into three.js.
export {
  BufferAttribute,
  BufferGeometry,
  Color,
  LineSegments,
  Matrix4,
  PerspectiveCamera,
  Points,
  Quaternion,
  Scene,
  ShaderMaterial,
  Sphere,
  Spherical,
  Vector3,
  WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
