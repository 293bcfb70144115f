// Distances to the nearest point of a cloud, by a k-d tree in two flat arrays.

const LEAF = 8;

/// Splits order[begin, end) at its middle by the axis: smaller ones in front (quickselect).
function split(order, xyz, begin, end, axis) {
  const middle = (begin + end) >> 1;
  let low = begin;
  let high = end - 1;
  while (low < high) {
    const pivot = xyz[3 * order[(low + high) >> 1] + axis];
    let i = low;
    let j = high;
    while (i <= j) {
      while (xyz[3 * order[i] + axis] < pivot) i++;
      while (xyz[3 * order[j] + axis] > pivot) j--;
      if (i <= j) {
        [order[i], order[j]] = [order[j], order[i]];
        i++;
        j--;
      }
    }
    if (middle <= j) high = j;
    else if (middle >= i) low = i;
    else break;
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
    if (most - least > width) [widest, width] = [axis, most - least];
  }
  return widest;
}

export class NearestPoints {
  /// xyz: x, y, z, x, y, z, ...
  constructor(xyz) {
    const count = xyz.length / 3;
    const order = Uint32Array.from({ length: count }, (_, i) => i);
    this.axis = new Uint8Array(count); // of the split at this place of the order
    const parts = [[0, count]];
    while (parts.length > 0) {
      const [begin, end] = parts.pop();
      if (end - begin <= LEAF) continue;
      const axis = widestAxis(order, xyz, begin, end);
      const middle = split(order, xyz, begin, end, axis);
      this.axis[middle] = axis;
      parts.push([begin, middle], [middle + 1, end]);
    }
    this.xyz = new Float32Array(xyz.length);
    for (let i = 0; i < count; i++) {
      for (let axis = 0; axis < 3; axis++) this.xyz[3 * i + axis] = xyz[3 * order[i] + axis];
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
        const dx = p[i] - x;
        const dy = p[i + 1] - y;
        const dz = p[i + 2] - z;
        this.best = Math.min(this.best, dx * dx + dy * dy + dz * dz);
      }
      return;
    }
    const middle = (begin + end) >> 1;
    const axis = this.axis[middle];
    const offset = (axis === 0 ? x : axis === 1 ? y : z) - p[3 * middle + axis];
    const dx = p[3 * middle] - x;
    const dy = p[3 * middle + 1] - y;
    const dz = p[3 * middle + 2] - z;
    this.best = Math.min(this.best, dx * dx + dy * dy + dz * dz);
    if (offset < 0) this.search(x, y, z, begin, middle);
    else this.search(x, y, z, middle + 1, end);
    if (offset * offset >= this.best) return;
    if (offset < 0) this.search(x, y, z, middle + 1, end);
    else this.search(x, y, z, begin, middle);
  }
}
