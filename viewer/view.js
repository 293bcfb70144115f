// Made from viewer/src by `make viewer`.
(() => {
  // src/three.js
  var {
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
    WebGLRenderer
  } = globalThis.THREE;

  // src/frame.js
  var FARTHEST_START = 3;
  function reach(xyz) {
    const step = Math.max(1, Math.floor(xyz.length / 3 / 2e4));
    const distances = [];
    for (let i = 0; i + 2 < xyz.length; i += 3 * step) {
      distances.push(Math.hypot(xyz[i], xyz[i + 1], xyz[i + 2]));
    }
    distances.sort((a, b) => a - b);
    return distances[Math.floor(0.98 * (distances.length - 1))] ?? 0;
  }
  var Frame = class {
    constructor(pair2) {
      this.size = Math.max(reach(pair2.source.xyz), reach(pair2.target.xyz)) || 1;
      this.sourceOrigin = pair2.source.origin;
      this.targetOrigin = pair2.target.origin;
      const apart = new Vector3(...pair2.source.origin.map((v, i) => v - pair2.target.origin[i]));
      this.startDistance = apart.length();
      apart.divideScalar(this.size);
      this.startIsNearer = apart.length() > FARTHEST_START;
      if (this.startIsNearer)
        apart.setLength(FARTHEST_START);
      this.start = { turn: new Quaternion(), middle: apart };
    }
    /// Where a pose (16 numbers, row-major) puts the source: its turn, and the place of its middle.
    place(pose) {
      const m = new Matrix4().set(...pose);
      const middle = new Vector3(...this.sourceOrigin).applyMatrix4(m);
      middle.sub(new Vector3(...this.targetOrigin)).divideScalar(this.size);
      return { turn: new Quaternion().setFromRotationMatrix(m), middle };
    }
    /// From points about the source's middle, in its units, to the scene.
    matrix({ turn, middle }) {
      const scale = new Vector3().setScalar(1 / this.size);
      return new Matrix4().compose(middle, turn, scale);
    }
  };
  function between(from, to, share) {
    return {
      turn: from.turn.clone().slerp(to.turn, share),
      middle: from.middle.clone().lerp(to.middle, share)
    };
  }

  // src/keys.js
  var ORBIT_DEGREES = 5;
  var onPicture = {
    ArrowLeft: (page2) => page2.stage?.orbit(-ORBIT_DEGREES, 0),
    ArrowRight: (page2) => page2.stage?.orbit(ORBIT_DEGREES, 0),
    ArrowUp: (page2) => page2.stage?.orbit(0, ORBIT_DEGREES),
    ArrowDown: (page2) => page2.stage?.orbit(0, -ORBIT_DEGREES),
    "+": (page2) => page2.stage?.zoom(0.9),
    "=": (page2) => page2.stage?.zoom(0.9),
    "-": (page2) => page2.stage?.zoom(1 / 0.9),
    Home: (page2) => page2.stage?.lookFrom(),
    " ": (page2) => page2.motion.togglePlay()
  };
  var anywhere = {
    p: (page2) => page2.motion.togglePlay(),
    b: (page2) => page2.motion.setShare(0),
    a: (page2) => page2.motion.setShare(1),
    j: (page2) => page2.chooseNext(1),
    k: (page2) => page2.chooseNext(-1),
    1: (page2) => page2.setColour("plain"),
    2: (page2) => page2.setColour("residual"),
    3: (page2) => page2.setColour("significance"),
    s: (page2) => page2.toggle("source"),
    t: (page2) => page2.toggle("target"),
    g: (page2) => page2.toggle("ghost"),
    m: (page2) => page2.toggle("matches"),
    d: (page2) => page2.theme.toggle()
  };
  function listenToKeys(canvas, page2) {
    canvas.addEventListener("keydown", (event) => act(onPicture, event, page2));
    document.addEventListener("keydown", (event) => act(anywhere, event, page2));
  }
  function act(keys, event, page2) {
    if (event.ctrlKey || event.altKey || event.metaKey)
      return;
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action === void 0)
      return;
    event.preventDefault();
    action(page2);
  }

  // src/text.js
  var number = (value, digits = 3) => value === null ? "not known" : String(Number(value.toPrecision(digits)));
  var percent = (value) => value === null ? "not known" : `${Math.round(100 * value)} %`;
  var milliseconds = (ms) => `${ms.toFixed(ms < 10 ? 2 : 1)} ms`;
  var fileName = (path) => path.split(/[\\/]/).filter(Boolean).pop() ?? path;
  var statusText = {
    ok: "aligned",
    low_confidence: "not sure: more likely wrong than right",
    ambiguous: "ambiguous: another pose fits as well",
    scales_differ: "the clouds' sizes differ: other units?",
    timed_out: "the time budget was spent: nothing has judged the pose",
    too_few_points: "no pose: too few points",
    not_finite: "no pose: coordinates that are not finite",
    degenerate: "no pose: the points determine no rotation",
    cancelled: "no pose: cancelled"
  };
  var kindText = {
    answer: "answer",
    alternative: "alternative",
    hypothesis: "hypothesis",
    coarse: "global register"
  };
  function angleBetween(a, b) {
    let squared = 0;
    for (let row = 0; row < 3; row++) {
      for (let column = 0; column < 3; column++) {
        squared += (a[4 * row + column] - b[4 * row + column]) ** 2;
      }
    }
    return 2 * Math.asin(Math.min(1, Math.sqrt(squared / 8))) * 180 / Math.PI;
  }

  // src/legend.js
  var $ = (id) => document.getElementById(id);
  function showLegend(colour, most) {
    $("legend-plain").hidden = colour !== "plain";
    $("legend-scale").hidden = colour === "plain";
    const residual = colour === "residual";
    $("scale").className = residual ? "residual" : "significance";
    $("scale-low").textContent = "0";
    $("scale-high").textContent = residual ? `≥ ${number(most)}` : "1";
    $("scale-name").textContent = residual ? "distance to the other cloud, at the chosen pose" : "significance: what the network expects of a point";
  }

  // src/motion.js
  var PLAY_MS = 2400;
  var SWITCH_MS = 500;
  var eased = (share) => share * share * (3 - 2 * share);
  var calm = matchMedia("(prefers-reduced-motion: reduce)");
  var Motion = class {
    /// onChange(motion) is called after every change.
    constructor(frame, poses, onChange) {
      this.frame = frame;
      this.ends = poses.map((p) => frame.place(p.pose));
      this.onChange = onChange;
      this.index = 0;
      this.share = poses.length > 0 ? 1 : 0;
      this.end = this.ends[0] ?? frame.start;
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
      if (this.share === 0)
        this.share = 1;
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
      this.playing = this.request !== void 0;
      this.onChange(this);
    }
    stop() {
      cancelAnimationFrame(this.request);
      this.request = void 0;
      this.playing = false;
      this.end = this.ends[this.index] ?? this.frame.start;
    }
    /// Calls step(0...1) over the time; at once where the reader wants no motion.
    run(ms, step) {
      const begin = performance.now();
      const next = (now) => {
        const share = calm.matches ? 1 : Math.min(1, Math.max(0, (now - begin) / ms));
        step(eased(share));
        if (share === 1)
          this.stop();
        else
          this.request = requestAnimationFrame(next);
        this.onChange(this);
      };
      if (calm.matches)
        next(begin);
      else
        this.request = requestAnimationFrame(next);
    }
  };

  // src/panel.js
  var $2 = (id) => document.getElementById(id);
  function element(tag, className, text) {
    const made = document.createElement(tag);
    if (className)
      made.className = className;
    if (text !== void 0)
      made.textContent = text;
    return made;
  }
  function cloudText({ given, shown, unusable }) {
    const parts = [`${given.toLocaleString("en")} points`];
    if (shown < given - unusable)
      parts.push(`${shown.toLocaleString("en")} of them shown`);
    if (unusable > 0)
      parts.push(`${unusable.toLocaleString("en")} not finite`);
    return parts.join(", ");
  }
  function facts(pair2) {
    const { result } = pair2;
    const list = [
      ["confidence", percent(result.confidence)],
      ["overlap", percent(result.pose === null ? null : result.overlap)],
      ["residual", result.pose === null ? "not known" : `${number(result.rmse)} r.m.s.`],
      ["rotation", result.rotation_error_deg === null ? "not known" : `± ${number(result.rotation_error_deg, 2)}°`],
      ["source", cloudText(pair2.source)],
      ["target", cloudText(pair2.target)]
    ];
    if (pair2.model)
      list.push(["model", pair2.mode ? `${pair2.model}, mode ${pair2.mode}` : pair2.model]);
    return list;
  }
  function showFacts(pair2, frame) {
    const { status } = pair2.result;
    const names = [pair2.source.name, pair2.target.name];
    $2("names").textContent = names.map(fileName).join(" → ");
    $2("names").title = names.join(" → ");
    document.title = `${$2("names").textContent}: vnreg`;
    $2("status").textContent = status;
    $2("status").dataset.status = status;
    $2("status-text").textContent = statusText[status] ?? "";
    for (const [name, value] of facts(pair2)) {
      $2("facts").append(element("dt", "", name), element("dd", "", value));
    }
    if (frame.startIsNearer) {
      $2("note").textContent = `Before: drawn nearer. The clouds lie ${number(frame.startDistance)} apart, ${number(frame.startDistance / frame.size, 2)} times their size.`;
    }
  }
  function showPoses(pair2, choose) {
    const scores = pair2.poses.map((p) => p.score).filter((s) => s !== null);
    const least = Math.min(...scores);
    const range = Math.max(...scores) - least || 1;
    pair2.poses.forEach((pose, i) => {
      const button = element("button", "pose");
      button.type = "button";
      button.append(element("span", "kind", kindText[pose.kind]));
      const away = angleBetween(pose.pose, pair2.result.pose);
      button.append(element("span", "away", i === 0 ? "" : `${number(away, 3)}° off`));
      button.append(element("span", "score", pose.score === null ? "–" : number(pose.score)));
      const bar = element("span", "bar");
      bar.style.width = pose.score === null ? "0" : `${4 + 96 * (pose.score - least) / range}%`;
      button.append(bar);
      button.addEventListener("click", () => choose(i));
      const item = element("li");
      item.append(button);
      $2("poses").append(item);
    });
    $2("poses-section").hidden = pair2.poses.length === 0;
  }
  function markPose(index) {
    document.querySelectorAll(".pose").forEach((button, i) => {
      button.setAttribute("aria-pressed", String(i === index));
      if (i === index)
        button.scrollIntoView?.({ block: "nearest" });
    });
  }
  function showTimes(ms) {
    const stages = Object.entries(ms).filter(([name, value]) => name !== "total" && value > 0);
    const most = Math.max(...stages.map(([, value]) => value), 1e-9);
    for (const [name, value] of stages) {
      const row = element("div", "time");
      row.append(element("span", "", name));
      const track = element("span", "track");
      const bar = element("span", "bar");
      bar.style.width = `${100 * value / most}%`;
      track.append(bar);
      row.append(track, element("span", "ms", milliseconds(value)));
      $2("times").append(row);
    }
    $2("total").textContent = milliseconds(ms.total);
  }

  // src/nearest.js
  var LEAF = 8;
  function split(order, xyz, begin, end, axis) {
    const middle = begin + end >> 1;
    let low = begin;
    let high = end - 1;
    while (low < high) {
      const pivot = xyz[3 * order[low + high >> 1] + axis];
      let i = low;
      let j = high;
      while (i <= j) {
        while (xyz[3 * order[i] + axis] < pivot)
          i++;
        while (xyz[3 * order[j] + axis] > pivot)
          j--;
        if (i <= j) {
          [order[i], order[j]] = [order[j], order[i]];
          i++;
          j--;
        }
      }
      if (middle <= j)
        high = j;
      else if (middle >= i)
        low = i;
      else
        break;
    }
    return middle;
  }
  function widestAxis(order, xyz, begin, end) {
    let widest = 0;
    let width = -1;
    for (let axis = 0; axis < 3; axis++) {
      let least = Infinity;
      let most = -Infinity;
      for (let i = begin; i < end; i++) {
        const v = xyz[3 * order[i] + axis];
        least = Math.min(least, v);
        most = Math.max(most, v);
      }
      if (most - least > width)
        [widest, width] = [axis, most - least];
    }
    return widest;
  }
  var NearestPoints = class {
    /// xyz: x, y, z, x, y, z, ...
    constructor(xyz) {
      const count = xyz.length / 3;
      const order = Uint32Array.from({ length: count }, (_, i) => i);
      this.axis = new Uint8Array(count);
      const parts = [[0, count]];
      while (parts.length > 0) {
        const [begin, end] = parts.pop();
        if (end - begin <= LEAF)
          continue;
        const axis = widestAxis(order, xyz, begin, end);
        const middle = split(order, xyz, begin, end, axis);
        this.axis[middle] = axis;
        parts.push([begin, middle], [middle + 1, end]);
      }
      this.xyz = new Float32Array(xyz.length);
      for (let i = 0; i < count; i++) {
        for (let axis = 0; axis < 3; axis++)
          this.xyz[3 * i + axis] = xyz[3 * order[i] + axis];
      }
    }
    /// The distance from (x, y, z) to the nearest point; `limit` if there is none closer.
    distance(x, y, z, limit) {
      this.best = limit * limit;
      this.search(x, y, z, 0, this.xyz.length / 3);
      return Math.sqrt(this.best);
    }
    search(x, y, z, begin, end) {
      const p = this.xyz;
      if (end - begin <= LEAF) {
        for (let i = 3 * begin; i < 3 * end; i += 3) {
          const dx2 = p[i] - x;
          const dy2 = p[i + 1] - y;
          const dz2 = p[i + 2] - z;
          this.best = Math.min(this.best, dx2 * dx2 + dy2 * dy2 + dz2 * dz2);
        }
        return;
      }
      const middle = begin + end >> 1;
      const axis = this.axis[middle];
      const offset = (axis === 0 ? x : axis === 1 ? y : z) - p[3 * middle + axis];
      const dx = p[3 * middle] - x;
      const dy = p[3 * middle + 1] - y;
      const dz = p[3 * middle + 2] - z;
      this.best = Math.min(this.best, dx * dx + dy * dy + dz * dz);
      if (offset < 0)
        this.search(x, y, z, begin, middle);
      else
        this.search(x, y, z, middle + 1, end);
      if (offset * offset >= this.best)
        return;
      if (offset < 0)
        this.search(x, y, z, middle + 1, end);
      else
        this.search(x, y, z, begin, middle);
    }
  };

  // src/residuals.js
  var POINTS_AT_A_TIME = 4e3;
  var pause = () => new Promise((resolve) => setTimeout(resolve));
  var Residuals = class {
    constructor(pair2, frame) {
      this.frame = frame;
      this.clouds = [pair2.source.xyz, pair2.target.xyz];
      this.trees = [null, null];
      this.most = 3 * pair2.result.inlier_distance || 0.1 * frame.size;
    }
    /// Shares of `most` as bytes, [source, target], for the source at a place (frame.place());
    /// null if `wanted()` has become false meanwhile.
    async measure(place, wanted) {
      var _a, _b;
      const toTarget = this.frame.matrix(place);
      toTarget.premultiply(new Matrix4().makeScale(...Array(3).fill(this.frame.size)));
      const moves = [toTarget, toTarget.clone().invert()];
      const result = [];
      for (let side = 0; side < 2; side++) {
        (_a = this.trees)[_b = 1 - side] ?? (_a[_b] = new NearestPoints(this.clouds[1 - side]));
        const bytes2 = await this.measureSide(side, moves[side], wanted);
        if (bytes2 === null)
          return null;
        result.push(bytes2);
      }
      return result;
    }
    async measureSide(side, move, wanted) {
      const xyz = this.clouds[side];
      const bytes2 = new Uint8Array(xyz.length / 3);
      const point = new Vector3();
      for (let i = 0; i < bytes2.length; i++) {
        if (i % POINTS_AT_A_TIME === 0) {
          await pause();
          if (!wanted())
            return null;
        }
        point.fromArray(xyz, 3 * i).applyMatrix4(move);
        const distance = this.trees[1 - side].distance(point.x, point.y, point.z, this.most);
        bytes2[i] = Math.round(255 * distance / this.most);
      }
      return bytes2;
    }
  };

  // src/cloud_points.js
  var vertexShader = `
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
  var fragmentShader = `
  varying vec3 colour;
  void main() { gl_FragColor = vec4(colour, 1.0); }`;
  function makeMaterial() {
    const colour = () => ({ value: new Color() });
    const number2 = (value) => ({ value });
    return new ShaderMaterial({
      vertexShader,
      fragmentShader,
      uniforms: {
        plain: colour(),
        low: colour(),
        mid: colour(),
        high: colour(),
        paper: colour(),
        size: number2(2),
        valued: number2(0),
        fade: number2(0)
      }
    });
  }
  var CloudPoints = class {
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
        this.uniforms[name].value.setStyle(colour, "srgb-linear");
      }
    }
    /// bytes: 0 to 255 per point; null: the plain colour for all.
    setValues(bytes2) {
      this.uniforms.valued.value = bytes2 === null ? 0 : 1;
      if (bytes2 === null)
        return;
      const attribute = this.object.geometry.getAttribute("value");
      attribute.array.set(bytes2);
      attribute.needsUpdate = true;
    }
    place(matrix) {
      this.object.matrix.copy(matrix);
    }
    /// Draws the first points only; any first ones are an even sample.
    setShare(share) {
      this.object.geometry.setDrawRange(0, Math.ceil(this.count * share));
    }
  };

  // src/detail.js
  var SLOW_MS = 29;
  var FAST_MS = 25;
  var FEWEST = 1e4;
  var Detail = class {
    constructor(points) {
      this.least = Math.min(1, FEWEST / Math.max(points, 1));
      this.share = 1;
      this.rest();
    }
    /// Takes the time of a frame while the view moves.
    frame(now) {
      if (this.last !== null)
        this.adapt(Math.min(now - this.last, 3 * SLOW_MS));
      this.last = now;
    }
    /// Goes by a running mean of the times, so that one long frame changes little.
    adapt(ms) {
      this.mean = this.mean === null ? ms : this.mean + 0.2 * (ms - this.mean);
      if (this.mean > 2 * SLOW_MS) {
        this.share *= 0.5;
        this.mean = null;
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
  };

  // src/match_lines.js
  var vertexShader2 = `
  uniform mat4 motion, still;
  uniform vec3 agree, differ;
  attribute float moves, agrees, weight;
  varying vec4 colour;
  void main() {
    vec4 place = moves > 0.5 ? motion * vec4(position, 1.0) : still * vec4(position, 1.0);
    gl_Position = projectionMatrix * viewMatrix * place;
    colour = vec4(mix(differ, agree, agrees), 0.25 + 0.75 * weight);
  }`;
  var fragmentShader2 = `
  varying vec4 colour;
  void main() { gl_FragColor = colour; }`;
  var forBothEnds = (values) => Float32Array.from({ length: 2 * values.length }, (_, i) => values[i >> 1]);
  var MatchLines = class {
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
      add("moves", Float32Array.from(ends, (_, i) => 1 - i % 2), 1);
      add("weight", forBothEnds(weight.map((w) => Math.sqrt(w / heaviest))), 1);
      add("agrees", new Float32Array(ends.length), 1);
      const uniforms = {
        motion: { value: new Matrix4() },
        still: { value: targetMatrix },
        agree: { value: new Color() },
        differ: { value: new Color() }
      };
      const material = new ShaderMaterial({ vertexShader: vertexShader2, fragmentShader: fragmentShader2, uniforms, transparent: true });
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
      let number2 = 0;
      const from = this.places;
      for (let i = 0; i < this.count; i++) {
        const a = transform(matrix.elements, from, 6 * i);
        const b = transform(still.value.elements, from, 6 * i + 3);
        const near = Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < limit;
        agrees.array.fill(near ? 1 : 0, 2 * i, 2 * i + 2);
        number2 += near ? 1 : 0;
      }
      agrees.needsUpdate = true;
      return number2;
    }
  };
  function transform(m, xyz, at) {
    const [x, y, z] = [xyz[at], xyz[at + 1], xyz[at + 2]];
    return [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
  }

  // src/stage.js
  var REST_MS = 180;
  var MOST_PIXELS_PER_CSS_PIXEL = 2;
  var Stage = class {
    /// Throws where the browser has no WebGL.
    constructor(canvas, pair2, frame) {
      this.canvas = canvas;
      this.frame = frame;
      this.renderer = new WebGLRenderer({ canvas, antialias: false, alpha: false });
      this.scene = new Scene();
      this.camera = new PerspectiveCamera(40, 1, 0.01, 200);
      this.controls = new OrbitControls(this.camera, canvas);
      this.controls.addEventListener("change", () => this.changed());
      this.controls.addEventListener("start", () => this.follows = false);
      this.makeClouds(pair2);
      this.detail = new Detail(this.clouds.source.count + this.clouds.target.count);
      new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
      this.sourceMiddle = new Vector3();
      this.resize();
      this.lookFrom();
    }
    /// `ghost` is the source as it was given; the described points lie on both clouds.
    makeClouds(pair2) {
      const { source, target, explanation: e } = pair2;
      this.clouds = {
        ghost: new CloudPoints(source.xyz),
        target: new CloudPoints(target.xyz),
        source: new CloudPoints(source.xyz)
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
      for (const cloud of this.all())
        this.scene.add(cloud.object);
      if (this.lines !== null)
        this.scene.add(this.lines.object);
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
      if (this.follows)
        this.fit();
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
      if (this.clouds.ghost.object.visible)
        middles.push(this.frame.start.middle);
      const ball = new Sphere().setFromPoints(middles);
      const direction = this.camera.position.clone().sub(this.controls.target).normalize();
      const angle = this.camera.fov / 2 * (Math.PI / 180);
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
      if (clientWidth === 0 || clientHeight === 0)
        return;
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXELS_PER_CSS_PIXEL));
      this.renderer.setSize(clientWidth, clientHeight, false);
      this.camera.aspect = clientWidth / clientHeight;
      this.camera.updateProjectionMatrix();
      if (this.follows)
        this.fit();
      this.changed();
    }
    /// Asks for a frame; with what can be drawn fluently until nothing has changed for a while.
    changed() {
      clearTimeout(this.resting);
      this.resting = setTimeout(() => this.rest(), REST_MS);
      this.wanted ?? (this.wanted = requestAnimationFrame((now) => {
        this.wanted = null;
        this.detail.frame(now);
        this.draw(this.detail.share);
      }));
    }
    rest() {
      this.detail.rest();
      this.draw(1);
    }
    draw(share) {
      for (const cloud of this.all())
        cloud.setShare(share);
      this.renderer.render(this.scene, this.camera);
    }
  };

  // src/theme.js
  var system = matchMedia("(prefers-color-scheme: dark)");
  var Theme = class {
    constructor(onChange) {
      this.onChange = onChange;
      system.addEventListener("change", () => onChange());
    }
    get dark() {
      const chosen = document.documentElement.dataset.theme;
      return chosen === void 0 ? system.matches : chosen === "dark";
    }
    toggle() {
      document.documentElement.dataset.theme = this.dark ? "light" : "dark";
      this.onChange();
    }
    /// A custom property of style.css.
    colour(name) {
      return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    }
  };

  // src/page.js
  var $3 = (id) => document.getElementById(id);
  var SLIDER_STEPS = 1e3;
  var Page = class {
    constructor(pair2, frame) {
      this.pair = pair2;
      this.frame = frame;
      this.colour = "plain";
      this.shown = { source: true, target: true, ghost: false, matches: false };
      this.residuals = new Residuals(pair2, frame);
      this.theme = new Theme(() => this.paint());
      this.motion = new Motion(frame, pair2.poses, () => this.moved());
      this.stage = this.makeStage();
      showFacts(pair2, frame);
      showPoses(pair2, (i) => this.choose(i));
      showTimes(pair2.result.ms);
      this.wireControls();
      this.disableWhatIsNotThere();
      markPose(0);
      this.paint();
      this.moved();
    }
    /// Null without WebGL: the panel is of use without the picture.
    makeStage() {
      try {
        return new Stage($3("canvas"), this.pair, this.frame);
      } catch {
        $3("no-webgl").hidden = false;
        return null;
      }
    }
    wireControls() {
      $3("slider").addEventListener("input", () => {
        this.motion.setShare(Number($3("slider").value) / SLIDER_STEPS);
      });
      $3("play").addEventListener("click", () => this.motion.togglePlay());
      $3("theme").addEventListener("click", () => this.theme.toggle());
      $3("reset").addEventListener("click", () => this.stage?.lookFrom());
      for (const input of document.querySelectorAll("input[name=colour]")) {
        input.addEventListener("change", () => this.setColour(input.value));
      }
      for (const name of Object.keys(this.shown)) {
        $3(`show-${name}`).addEventListener("change", () => this.toggle(name));
      }
    }
    disableWhatIsNotThere() {
      const { explanation, poses } = this.pair;
      $3("slider").disabled = $3("play").disabled = poses.length === 0;
      $3("colour-residual").disabled = poses.length === 0;
      $3("colour-significance").disabled = !explanation?.source.significance.length;
      $3("show-matches").disabled = !explanation?.matches.weight.length;
    }
    choose(index) {
      if (this.pair.poses[index] === void 0)
        return;
      this.motion.choose(index);
      markPose(index);
      this.measure();
    }
    chooseNext(step) {
      const count = this.pair.poses.length;
      if (count > 0)
        this.choose((this.motion.index + step + count) % count);
    }
    setColour(colour) {
      if ($3(`colour-${colour}`).disabled)
        return;
      $3(`colour-${colour}`).checked = true;
      this.colour = colour;
      this.paint();
      this.measure();
    }
    toggle(name) {
      if ($3(`show-${name}`).disabled)
        return;
      this.shown[name] = !this.shown[name];
      $3(`show-${name}`).checked = this.shown[name];
      this.paint();
    }
    /// After the source has moved.
    moved() {
      const { share, playing } = this.motion;
      const slider = $3("slider");
      slider.value = String(Math.round(SLIDER_STEPS * share));
      const words = share === 0 ? "before" : share === 1 ? "after" : `${Math.round(100 * share)} % of the way`;
      slider.setAttribute("aria-valuetext", words);
      $3("play").setAttribute("aria-pressed", String(playing));
      $3("play").textContent = playing ? "❚❚ Pause" : "▶ Play";
      this.stage?.placeSource(this.motion.place);
    }
    /// Colours, sizes and what is visible.
    paint() {
      showLegend(this.colour, this.residuals.most);
      $3("theme").textContent = this.theme.dark ? "☀ Light" : "☾ Dark";
      if (this.stage === null)
        return;
      const { clouds, lines, renderer } = this.stage;
      const significance = this.colour === "significance";
      const colour = (name) => this.theme.colour(name);
      const scale = significance ? "significance" : "residual";
      const shared = { paper: colour("paper") };
      for (const step of ["low", "mid", "high"])
        shared[step] = colour(`${scale}-${step}`);
      renderer.setClearColor(colour("paper"));
      for (const [name, cloud] of Object.entries(clouds)) {
        const side = /source/i.test(name) ? "source" : name;
        cloud.setColours({ ...shared, plain: colour(side === "describedTarget" ? "target" : side) });
        cloud.uniforms.size.value = this.pointSize(cloud.count);
        cloud.uniforms.fade.value = significance ? 0.7 : 0;
      }
      if (this.colour !== "residual") {
        for (const name of ["source", "target", "ghost"])
          clouds[name].setValues(null);
      }
      for (const name of ["source", "target", "ghost"])
        clouds[name].object.visible = this.shown[name];
      for (const [name, side] of [["describedSource", "source"], ["describedTarget", "target"]]) {
        if (clouds[name] === void 0)
          continue;
        clouds[name].object.visible = significance && this.shown[side];
        clouds[name].uniforms.size.value = 5 * renderer.getPixelRatio();
        clouds[name].uniforms.fade.value = 0;
      }
      if (lines !== null) {
        lines.setColours({ agree: colour("agree"), differ: colour("differ") });
        lines.object.visible = this.shown.matches;
        this.markMatches();
      }
      if (this.stage.follows)
        this.stage.fit();
      this.stage.changed();
    }
    /// Pixels: larger where a cloud has few points.
    pointSize(count) {
      return (count > 2e4 ? 1.5 : count > 4e3 ? 2 : 3) * this.stage.renderer.getPixelRatio();
    }
    /// Colours the lines by whether the chosen pose brings their ends together.
    markMatches() {
      const end = this.motion.ends[this.motion.index];
      const { lines } = this.stage;
      if (end === void 0 || lines.count === 0)
        return;
      const limit = this.residuals.most / this.frame.size;
      const number2 = lines.mark(this.frame.matrix(end), limit);
      $3("matches-count").textContent = `(${number2} of ${lines.count} agree)`;
    }
    /// Residuals at the chosen pose, if they are wanted.
    async measure() {
      if (this.stage === null)
        return;
      if (this.stage.lines !== null)
        this.markMatches();
      if (this.colour !== "residual")
        return;
      const { index } = this.motion;
      const wanted = () => this.colour === "residual" && this.motion.index === index;
      const values = await this.residuals.measure(this.motion.ends[index], wanted);
      if (values === null || !wanted())
        return;
      this.stage.clouds.source.setValues(values[0]);
      this.stage.clouds.ghost.setValues(values[0]);
      this.stage.clouds.target.setValues(values[1]);
      this.stage.changed();
    }
  };

  // src/pair_data.js
  function bytes(base64) {
    const text = atob(base64);
    const result = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++)
      result[i] = text.charCodeAt(i);
    return result.buffer;
  }
  var floats = (base64) => new Float32Array(bytes(base64));
  function readExplanation(e) {
    if (e === null)
      return null;
    const described = (d) => ({ xyz: floats(d.xyz), significance: floats(d.significance) });
    return {
      source: described(e.source),
      target: described(e.target),
      matches: { ends: new Uint32Array(bytes(e.matches.ends)), weight: floats(e.matches.weight) },
      hypotheses: e.hypotheses
    };
  }
  var same = (a, b) => a.every((value, i) => value === b[i]);
  function listPoses(result, explanation) {
    if (result.pose === null)
      return [];
    const answer = { pose: result.pose, score: result.score, kind: "answer" };
    const alternatives = result.alternatives.map((a) => ({ ...a, kind: "alternative" }));
    const poses = [answer, ...alternatives];
    for (const h of explanation?.hypotheses ?? []) {
      if (!poses.some((p) => same(p.pose, h.pose)))
        poses.push({ ...h, kind: "hypothesis" });
    }
    const isCoarse = (p) => same(p.pose, result.coarse_pose);
    const identity = result.coarse_pose.every((v, i) => v === (i % 5 === 0 ? 1 : 0));
    const coarse = poses.find(isCoarse);
    if (coarse !== void 0 && coarse !== answer)
      coarse.kind = "coarse";
    if (coarse === void 0 && !identity) {
      poses.push({ pose: result.coarse_pose, score: null, kind: "coarse" });
    }
    const rank = (p) => p === answer ? Infinity : p.score ?? -Infinity;
    return poses.sort((a, b) => rank(b) - rank(a) || 0);
  }
  function readPair(text) {
    const data = JSON.parse(text);
    const explanation = readExplanation(data.explanation);
    const cloud = (c) => ({ ...c, xyz: floats(c.xyz) });
    return {
      ...data,
      source: cloud(data.source),
      target: cloud(data.target),
      explanation,
      poses: listPoses(data.result, explanation)
    };
  }

  // src/main.js
  var pair = readPair(document.getElementById("pair").textContent);
  var page = new Page(pair, new Frame(pair));
  listenToKeys(document.getElementById("canvas"), page);
  var sourceMatrix = () => page.frame.matrix(page.motion.place).toArray();
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
      camera: page.stage?.camera.position.toArray() ?? null
    }),
    setShare: (share) => page.motion.setShare(share),
    choosePose: (index) => page.choose(index),
    orbit: (sideways, upwards) => page.stage?.orbit(sideways, upwards),
    drawAll: () => page.stage?.rest()
  };
})();
