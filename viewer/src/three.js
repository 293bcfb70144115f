// three.js as the page has loaded it (../three.js), for `import ... from "./three.js"`.
export const {
  BufferAttribute,
  BufferGeometry,
  Color,
  LineSegments,
  Matrix4,
  OrbitControls,
  PerspectiveCamera,
  Points,
  Quaternion,
  Scene,
  ShaderMaterial,
  Sphere,
  Spherical,
  Vector3,
  WebGLRenderer,
} = globalThis.THREE;
