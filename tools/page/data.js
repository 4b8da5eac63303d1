// --- Data: what view.cpp wrote, decoded when it is first shown ---

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), character => character.charCodeAt(0));
}

/// Numbers of four bytes, by a getter of DataView.
function decoded(base64, Kind, getter) {
  const view = new DataView(bytesOf(base64).buffer);
  const numbers = new Kind(view.byteLength / 4);
  for (let i = 0; i < numbers.length; ++i) numbers[i] = view[getter](4 * i, true);
  return numbers;
}
const decodedFloats = base64 => decoded(base64, Float32Array, 'getFloat32');
const decodedIntegers = base64 => decoded(base64, Uint32Array, 'getUint32');

/// The points of a frame about the scene's middle, fiber after fiber.
function decodedPoints(scene, frame) {
  const bytes = bytesOf(frame.points);
  const steps = new DataView(bytes.buffer);
  const points = new Float32Array(bytes.length / 2);
  for (let i = 0; i < points.length; ++i) {
    points[i] = scene.step * (steps.getUint16(2 * i, true) - 32767.5);
  }
  return points;
}

function decodedMarkers(markers) {
  return {
    places: decodedFloats(markers.places),
    distances: decodedFloats(markers.distances),
    depths: decodedFloats(markers.depths),
    times: decodedFloats(markers.times),
    segments: decodedIntegers(markers.segments),
  };
}

// Of groups, in turns; contacts have other colours.
const kGroupColours = [[227, 189, 134], [122, 166, 236], [158, 204, 116], [200, 156, 226],
                       [232, 150, 108], [216, 217, 224], [108, 196, 190], [228, 214, 96]];
const kColourOfNone = [120, 124, 132];

class Frames {
  constructor(scene) {
    this.scene = scene;
    this.begin = decodedIntegers(scene.begin);
    this.radii = decodedFloats(scene.radii);
    this.groups = decodedIntegers(scene.groupsOfFibers);  // 0 for none; empty if there are none
    this.thickest = this.radii.reduce((a, b) => Math.max(a, b));
    this.cache = new Map();
  }
  get count() { return this.scene.frames.length; }

  /// The depth of the deepest marker of a kind in any frame.
  deepest(kind) {
    return this.scene.frames.reduce((most, frame) => Math.max(most, frame[kind].deepest), 0);
  }
  get(index) {
    if (!this.cache.has(index)) {
      const frame = this.scene.frames[index];
      this.cache.set(index, {
        points: decodedPoints(this.scene, frame),
        touching: bytesOf(frame.touching),
        markers: decodedMarkers(frame.markers),
        meshmarkers: decodedMarkers(frame.meshmarkers),
      });
    }
    return this.cache.get(index);
  }
  colourOfGroup(number) {
    if (number === 0) return kColourOfNone;
    return kGroupColours[((number || 1) - 1) % kGroupColours.length];
  }
  colourOf(fiber) { return this.colourOfGroup(this.groups[fiber]); }

  /// Fibers count in their own files.
  nameOf(fiber) {
    const group = this.scene.groups[this.groups[fiber] - 1];
    return group ? `fiber ${fiber - group.first} of ${group.name}` : `fiber ${fiber}`;
  }

  /// The radii at both ends of the line from a point to the next one.
  radiiFrom(point) {
    const at = p => this.radii[p % this.radii.length];
    return [at(point), at(this.scene.tapers ? point + 1 : point)];
  }

  /// The number in the file of a segment on a line that is drawn.
  /// @param along  where on the line, from 0 to 1
  segmentAt(fiber, line, along) {
    if (!this.segmentsOfFibers) {
      this.segmentsOfFibers = decodedIntegers(this.scene.segmentsOfFibers);
    }
    const step = this.scene.pointStep, first = line * step;
    const count = Math.min(step, this.segmentsOfFibers[fiber] - first);
    return first + Math.min(Math.floor(along * count), count - 1);
  }
}
