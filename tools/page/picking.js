// --- Picking: what is drawn at a place of the picture ---

/// Looks for the fiber, marker or mesh at x, y, in pixels of the window. What lies there comes first, the
/// nearest to the eye of it; else what is nearest in the picture, up to a few pixels off.
class Picker {
  constructor(eye, x, y) {
    const {width, height} = eye.room;
    const matrix = new THREE.Matrix4().multiplyMatrices(eye.camera.projectionMatrix,
                                                        eye.camera.matrixWorldInverse);
    this.m = matrix.elements;
    this.half = [width / 2, height / 2];
    this.at = [x, y];
    this.pixelsOfOne = height / 2 / eye.tangent;  // at distance 1
    this.best = {miss: 4, depth: Infinity};
    this.farthest = Infinity;  // what is behind a solid mesh is not seen
  }

  /// x and y about the place in question, and the distance from the eye.
  project(numbers, i) {
    const m = this.m, x = numbers[i], y = numbers[i + 1], z = numbers[i + 2];
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    return [
      ((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) * this.half[0] - this.at[0],
      (1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * this.half[1] - this.at[1], w,
    ];
  }

  /// @param off  pixels from the middle of what is drawn, `reach` pixels wide to each side
  offer(off, reach, depth, what) {
    if (depth > this.farthest) return;
    const miss = Math.max(off - reach, 0);
    if (miss > this.best.miss || (miss === this.best.miss && depth >= this.best.depth)) return;
    this.best = {miss, depth, ...what};
  }

  searchFibers(frames, points, least) {
    for (let f = 0; f + 1 < frames.begin.length; ++f) {
      let a = this.project(points, 3 * frames.begin[f]);
      for (let p = frames.begin[f]; p + 1 < frames.begin[f + 1]; ++p) {
        const b = this.project(points, 3 * p + 3);
        if (a[2] > 0 && b[2] > 0) {
          const d = [b[0] - a[0], b[1] - a[1]];
          const square = d[0] * d[0] + d[1] * d[1];
          const along = square > 0
              ? Math.min(Math.max(-(a[0] * d[0] + a[1] * d[1]) / square, 0), 1) : 0;
          const depth = a[2] + along * (b[2] - a[2]), [from, to] = frames.radiiFrom(p);
          const radius = from + along * (to - from);
          const off = Math.hypot(a[0] + along * d[0], a[1] + along * d[1]);
          this.offer(off, Math.max(radius * this.pixelsOfOne / depth, least), depth,
                     {fiber: f, line: p - frames.begin[f], along});
        }
        a = b;
      }
    }
  }

  searchMarkers(markers) {
    const {places} = markers.shown;
    const size = markers.uniforms.size.value, lift = markers.uniforms.lift.value;
    for (let i = 0; i < places.length / 3; ++i) {
      const [x, y, depth] = this.project(places, 3 * i);
      if (depth <= 0) continue;
      const reach = Math.max(size * this.pixelsOfOne / depth, markers.leastPixels);
      this.offer(Math.hypot(x, y), reach, depth - lift - reach * depth / this.pixelsOfOne,
                 {marker: i, markers});
    }
  }
}

/// @return {fiber, line, along} of those drawn, or {marker, markers}, or {mesh, triangle}, or null
function pick(eye, x, y, frames, frame, kinds, meshes) {
  const picker = new Picker(eye, x, y);
  const place = new THREE.Vector2(x / picker.half[0] - 1, 1 - y / picker.half[1]);
  const hit = meshes.hitAt(eye.camera, place);
  if (hit && !meshes.material.transparent) {
    picker.farthest = picker.project(hit.point.toArray(), 0)[2] + 2 * frames.thickest;
  }
  picker.searchFibers(frames, frame.points, 0.55);
  for (const markers of kinds) {
    if (markers.mesh.visible) picker.searchMarkers(markers);
  }
  return picker.best.depth < Infinity ? picker.best : hit;
}
