// --- Where to look from ---

/// Unit vectors: the one that azimuth 0 looks from, the one of azimuth 90, and up.
function axesAbout(up) {
  return [1, 2, 0].map(k => {
    const axis = [0, 0, 0];
    axis[('xyz'.indexOf(up) + k) % 3] = 1;
    return new THREE.Vector3(...axis);
  });
}

/// The direction along which the points vary least, by power iteration on what is left of the
/// trace.
function flattestDirection(points) {
  const mean = [0, 0, 0], m = [0, 0, 0, 0, 0, 0, 0, 0, 0];
  const count = points.length / 3;
  for (let i = 0; i < points.length; ++i) mean[i % 3] += points[i] / count;
  for (let p = 0; p < points.length; p += 3) {
    for (let r = 0; r < 3; ++r) {
      for (let c = 0; c < 3; ++c) {
        m[3 * r + c] += (points[p + r] - mean[r]) * (points[p + c] - mean[c]) / count;
      }
    }
  }
  const trace = m[0] + m[4] + m[8];
  let v = new THREE.Vector3(0.8, 0.5, 0.3);
  for (let k = 0; k < 100; ++k) {
    const w = new THREE.Vector3(
        (trace - m[0]) * v.x - m[1] * v.y - m[2] * v.z,
        -m[3] * v.x + (trace - m[4]) * v.y - m[5] * v.z,
        -m[6] * v.x - m[7] * v.y + (trace - m[8]) * v.z);
    if (w.length() === 0) break;
    v = w.normalize();
  }
  return v;
}

/// Degrees of azimuth and elevation.
function anglesOf(direction, up) {
  const [ahead, aside, above] = axesAbout(up);
  return {
    azimuth: THREE.Math.radToDeg(Math.atan2(direction.dot(aside), direction.dot(ahead))),
    elevation: THREE.Math.radToDeg(Math.asin(
        Math.min(Math.max(direction.dot(above) / direction.length(), -1), 1))),
  };
}

/// A view that shows the points broadside, a little from above.
function openingView(points, up) {
  const direction = flattestDirection(points);
  const [ahead, aside, above] = axesAbout(up);
  const front = ahead.addScaledVector(aside, -0.4).addScaledVector(above, 0.5);
  if (direction.dot(front) < 0) direction.negate();
  const {azimuth, elevation} = anglesOf(direction, up);
  return {azimuth, elevation: Math.min(Math.max(elevation, 13), 40), zoom: 1};
}

/// The range of all numbers, or of nearly all if the few others lie far out.
function usualRange(numbers) {
  let low = Infinity, high = -Infinity;
  for (const number of numbers) {
    if (number < low) low = number;
    if (number > high) high = number;
  }
  // Points of a fiber follow one another, so a sample at even steps would miss the same part of all
  // fibers. The golden ratio meets all parts.
  const kSample = 20000;
  const sample = numbers.length <= kSample ? numbers.slice() : new Float32Array(kSample).map(
      (_, i) => numbers[Math.floor(0.6180339887 * i % 1 * numbers.length)]);
  sample.sort();
  const tail = Math.floor(0.005 * sample.length);
  const from = sample[tail], to = sample[sample.length - 1 - tail];
  const near = 0.25 * (to - from);
  return high - low > 4 * (to - from) && near > 0 ? [from - near, to + near] : [low, high];
}

/// Finds the distance from which points are all in the picture.
class Framing {
  /// @param frames  all of them, so that nothing leaves the picture as it plays
  /// @param radius  of the thickest fiber
  constructor(frames, radius) {
    this.frames = frames;
    this.radius = radius;
    const ranges = [0, 1, 2].map(k => {
      const axis = new THREE.Vector3().setComponent(k, 1);
      return usualRange(this.along(axis));
    });
    const low = new THREE.Vector3(...ranges.map(range => range[0]));
    const high = new THREE.Vector3(...ranges.map(range => range[1]));
    this.sphere = new THREE.Box3(low, high).getBoundingSphere(new THREE.Sphere());
    this.sphere.radius = (this.sphere.radius + radius) || 1;
    this.farthest = this.sphere.radius;  // from the sphere's centre
    const {x, y, z} = this.sphere.center;
    for (const points of frames) {
      for (let i = 0; i < points.length; i += 3) {
        const off = Math.hypot(points[i] - x, points[i + 1] - y, points[i + 2] - z) + radius;
        if (off > this.farthest) this.farthest = off;
      }
    }
  }

  /// The coordinates of all points along a direction.
  along({x, y, z}) {
    const count = this.frames.reduce((sum, points) => sum + points.length / 3, 0);
    const numbers = new Float32Array(count);
    let n = 0;
    for (const points of this.frames) {
      for (let i = 0; i < points.length; i += 3) {
        numbers[n++] = x * points[i] + y * points[i + 1] + z * points[i + 2];
      }
    }
    return numbers;
  }

  /// The target in the middle of what is seen, and the least distance from it.
  /// @param wide  of the room in the picture, half of it at distance 1
  /// @param high  of the room, in the same unit
  fit(right, upward, toEye, wide, high) {
    const seen = [right, upward, toEye].map(axis => this.along(axis));
    const ranges = seen.map(usualRange);
    const middle = ranges.map(([low, high]) => (low + high) / 2);
    let distance = 0;
    for (let i = 0; i < seen[0].length; ++i) {
      if (ranges.some(([low, high], k) => seen[k][i] < low || seen[k][i] > high)) continue;
      const off = Math.max((Math.abs(seen[0][i] - middle[0]) + this.radius) / wide,
                           (Math.abs(seen[1][i] - middle[1]) + this.radius) / high);
      distance = Math.max(distance, seen[2][i] - middle[2] + this.radius + off);
    }
    const target = new THREE.Vector3().addScaledVector(right, middle[0])
        .addScaledVector(upward, middle[1]).addScaledVector(toEye, middle[2]);
    return {target, distance: distance || this.sphere.radius};
  }
}

/// The camera and the mouse that moves it.
class Eye {
  constructor(canvas, changed, ended) {
    this.canvas = canvas;
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.changed = changed;
    this.ended = ended;
    this.room = {width: 1, height: 1, top: 0, left: 0, right: 0, bottom: 0};
  }

  /// Orbits turn about `up`, which OrbitControls reads once.
  open(framing, up) {
    const before = this.controls;
    this.framing = framing;
    this.up = up;
    this.camera.up.copy(axesAbout(up)[2]);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.rotateSpeed = 0.8;
    this.controls.minDistance = 1e-3 * framing.sphere.radius;
    this.controls.maxDistance = 40 * framing.sphere.radius;
    if (before) {
      this.controls.enableZoom = before.enableZoom;
      this.controls.autoRotate = before.autoRotate;
      before.dispose();
    }
    this.controls.addEventListener('change', this.changed);
    this.controls.addEventListener('end', this.ended);
  }

  /// Takes the first room in which the scene, seen as it opens, is nearly as large as in any.
  /// @param rooms  width and height of the picture, and how much of its sides panels cover
  chooseRoom(rooms, opening) {
    const distances = rooms.map(room => {
      this.room = room;
      return this.fitFrom(opening).distance;
    });
    this.room = rooms[distances.findIndex(distance => distance < 1.03 * Math.min(...distances))];
    const {width, height, top, left, right, bottom} = this.room;
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
  }

  get tangent() { return Math.tan(THREE.Math.degToRad(this.camera.fov / 2)); }

  fitFrom({azimuth, elevation}) {
    const angle = THREE.Math.degToRad(azimuth);
    const height = THREE.Math.degToRad(Math.min(Math.max(elevation, -89.9), 89.9));
    const [ahead, aside, above] = axesAbout(this.up);
    const outward = ahead.clone().multiplyScalar(Math.cos(angle))
        .addScaledVector(aside, Math.sin(angle));
    const toEye = outward.multiplyScalar(Math.cos(height))
        .addScaledVector(above, Math.sin(height));
    const right = new THREE.Vector3().crossVectors(above, toEye).normalize();
    const upward = new THREE.Vector3().crossVectors(toEye, right);
    const room = this.room;
    const wide = this.tangent * 0.94 *
        Math.max(room.width - room.left - room.right, 100) / room.height;
    const high = this.tangent * 0.96 *
        Math.max((room.height - room.top - room.bottom) / room.height, 0.3);
    return {toEye, ...this.framing.fit(right, upward, toEye, wide, high)};
  }

  /// @param view  azimuth, elevation, zoom, and the target if it is not the middle
  look(view) {
    const {toEye, target, distance} = this.fitFrom(view);
    this.controls.target.copy(view.target || target);
    this.camera.position.copy(this.controls.target)
        .addScaledVector(toEye, distance / (view.zoom || 1));
    this.controls.update();
    this.camera.updateMatrixWorld();
  }

  /// The view as it is, for look().
  get view() {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const angles = anglesOf(offset, this.up);
    return {...angles, zoom: this.fitFrom(angles).distance / offset.length(),
            target: this.controls.target.clone()};
  }

  /// Puts the planes of the camera around all points. Returns the range of distances of most.
  clip() {
    const {sphere, farthest} = this.framing;
    const distance = this.camera.position.distanceTo(sphere.center);
    // What is much nearer than the target is out of the picture. A plane nearer still would leave
    // the depth buffer too coarse to tell a marker from its fiber.
    this.camera.near = Math.max(
        distance - farthest, 0.05 * this.camera.position.distanceTo(this.controls.target));
    this.camera.far = distance + 2 * farthest;
    this.camera.updateProjectionMatrix();
    return [Math.max(distance - 1.05 * sphere.radius, 0), distance + 1.05 * sphere.radius];
  }
}
