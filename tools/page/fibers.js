// --- Fibers: ribbons that face the camera ---

// The points before and after a segment turn its ends, so that ribbons meet without a gap.
const kFiberVertex = `
  precision highp float;
  uniform mat4 modelViewMatrix, projectionMatrix;
  uniform float pixel, least, onlyTouching;
  attribute vec2 position;  // x across, y from start to end
  attribute vec3 before, start, end, after;
  attribute vec2 radii;     // at start and end
  attribute vec3 tint;      // of the group
  attribute vec4 look;      // hue of the fiber, place along it, light, touching
  attribute vec4 lookAfter;
  attribute vec4 ends;      // whether the fiber begins, ends, has ended before; how much picked
  varying vec3 vTangent, vSide, vEye, vTint;
  varying vec4 vLook;
  varying vec2 vPlace;      // along the axis, and beside it
  varying vec3 vCone;       // both radii, and the length
  varying float vPicked;
  vec3 directed(vec3 d, vec3 other) { return dot(d, d) > 0.0 ? normalize(d) : other; }
  void main() {
    if (ends.z > 0.5) {  // no segment: what is between two fibers
      gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      return;
    }
    vec3 a = (modelViewMatrix * vec4(start, 1.0)).xyz, b = (modelViewMatrix * vec4(end, 1.0)).xyz;
    vec3 along = directed(b - a, vec3(1.0, 0.0, 0.0));
    vec3 earlier = (modelViewMatrix * vec4(before, 1.0)).xyz;
    vec3 later = (modelViewMatrix * vec4(after, 1.0)).xyz;
    // Ends are round, and so are sharp bends, where one edge would lie far from the other.
    bool atStart = position.y < 0.5;
    vec3 neighbour = atStart ? directed(a - earlier, along) : directed(later - b, along);
    // So are both ends where the radius changes much, because one ball sticks out of the other end.
    float touching = look.w, length = distance(a, b);
    vec2 thin = -0.5 * (least + 0.7 * touching + 2.0 * ends.w) * pixel * vec2(a.z, b.z);
    vec2 drawn = max(radii, thin);
    float radius = atStart ? drawn.x : drawn.y, other = atStart ? drawn.y : drawn.x;
    float slope = (radius - other) / max(length, 1e-30);
    bool isSteep = abs(slope) > 0.6;
    bool isRound = isSteep || (atStart ? ends.x : ends.y) > 0.5 || dot(neighbour, along) < 0.6;
    vec3 tangent = isRound ? along : directed(neighbour + along, along);
    vec3 point = mix(a, b, position.y);
    vec3 eye = normalize(-point);
    vec3 side = directed(cross(tangent, eye), vec3(0.0, 1.0, 0.0));
    // The ribbon is so long and wide beyond a round end that the balls at both ends are on it.
    float beyond = isRound ? max(radius, other - length) : 0.0, wide = radius;
    if (isRound && isSteep) wide = max(radius, other);
    if (isRound && !isSteep && slope > 0.0) wide *= sqrt((1.0 + slope) / (1.0 - slope));
    vPlace = vec2(atStart ? -beyond : length + beyond, wide * position.x);
    vCone = vec3(drawn, length);
    point += vPlace.y * side + (atStart ? -beyond : beyond) * along;
    point += radius * sqrt(max(1.0 - position.x * position.x, 0.0)) * eye;
    vTangent = tangent; vSide = side; vEye = eye; vTint = tint; vPicked = ends.w;
    vLook = vec4(look.x, mix(look.yz, lookAfter.yz, position.y), look.w);
    gl_Position = projectionMatrix * vec4(point, 1.0);
    gl_Position.z -= 2e-5 * touching * gl_Position.w;
    // What touches may be deep inside: with the others dimmed it is drawn before them. So is what
    // is picked.
    if (touching * onlyTouching + ends.w > 0.5) gl_Position.z = 0.01 * gl_Position.z - 0.98 * gl_Position.w;
  }`;

// Kajiya and Kay's hair: light scattered across the tangent, and two highlights along it.
const kFiberFragment = `
  precision highp float;
  uniform vec3 light, background;
  uniform float nearest, farthest, onlyTouching, showTouching;
  varying vec3 vTangent, vSide, vEye, vTint;
  varying vec4 vLook;
  varying vec2 vPlace;
  varying vec3 vCone;
  varying float vPicked;
  void main() {
    vec3 t = normalize(vTangent);
    // The ball of the cone that reaches the farthest here: its centre is not beside this place, but
    // towards the thicker end.
    float slope = (vCone.x - vCone.y) / max(vCone.z, 1e-30);
    float nearer = vPlace.x - abs(vPlace.y) * slope * inversesqrt(max(1.0 - slope * slope, 1e-6));
    float centre = clamp(nearer, 0.0, vCone.z);
    vec2 off = vec2(vPlace.x - centre, vPlace.y) /
               mix(vCone.x, vCone.y, centre / max(vCone.z, 1e-30));
    if (dot(off, off) > 1.001) discard;
    vec3 normal = normalize(vSide) * off.y + vEye * sqrt(max(1.0 - off.y * off.y, 0.0));
    // What is dark has passed through the colour twice.
    vec3 hue = mix(0.54 * vTint * vTint, vTint,
                   clamp(vLook.x * 0.85 + 0.25 * vLook.y - 0.05, 0.0, 1.0));
    float across = dot(t, light);
    float diffuse = sqrt(max(1.0 - across * across, 0.0)) * (0.55 + 0.45 * dot(normal, light));
    vec3 halfway = normalize(light + vEye);
    float along = dot(t, halfway);
    float shine = pow(max(1.0 - along * along, 0.0), 40.0);
    float wide = pow(max(1.0 - along * along, 0.0), 8.0);
    float reach = vLook.z;
    vec3 colour = hue * (0.13 + 0.22 * reach + 0.75 * diffuse * reach) +
                  reach * (0.22 * shine * vec3(1.0, 0.95, 0.88) + 0.12 * wide * hue);
    float touching = vLook.w * showTouching;
    colour = mix(colour, background, 0.82 * onlyTouching * (1.0 - vLook.w));
    colour = mix(colour, vec3(1.0, 0.16, 0.11) * (0.72 + 0.28 * max(dot(normal, light), 0.0)),
                 touching);
    colour = mix(colour, vec3(0.45, 0.78, 1.0) * (0.5 + 0.5 * diffuse), 0.9 * vPicked);
    float depth = clamp((gl_FragCoord.z / gl_FragCoord.w - nearest) / (farthest - nearest),
                        0.0, 1.0);
    gl_FragColor = vec4(mix(colour, background, (0.42 - 0.2 * touching) * depth), 1.0);
  }`;

/// A strip of quads: x across as given, y from 0 to 1.
function makeStrip(across) {
  const strip = new THREE.BufferGeometry(), corners = [];
  for (let i = 0; i + 1 < across.length; ++i) {
    corners.push(...[0, 2, 1, 1, 2, 3].map(corner => 2 * i + corner));
  }
  strip.setIndex(corners);
  strip.setAttribute('position', new THREE.BufferAttribute(
      new Float32Array(across.flatMap(x => [x, 0, x, 1])), 2));
  return strip;
}

function instanced(geometry, attributes, count) {
  const result = new THREE.InstancedBufferGeometry();
  result.index = geometry.index;
  result.setAttribute('position', geometry.attributes.position);
  for (const name of Object.keys(attributes)) result.setAttribute(name, attributes[name]);
  result.maxInstancedCount = count;
  return result;
}

class Fibers {
  constructor(frames) {
    this.leastPixels = 1.1;
    const begin = frames.begin;
    this.frames = frames;
    this.points = begin[begin.length - 1];
    // One point before the first and two after the last, so that all four are inside the buffer.
    this.buffer =
        new THREE.InstancedInterleavedBuffer(new Float32Array(3 * (this.points + 3)), 3, 1);
    // One more, because each line reads the look of both its points.
    this.look =
        new THREE.InstancedInterleavedBuffer(new Uint8Array(4 * (this.points + 1)), 4, 1);
    this.ends = new THREE.InstancedBufferAttribute(new Uint8Array(4 * this.points), 4, true, 1);
    const ends = this.ends.array;
    for (let f = 0; f + 1 < begin.length; ++f) {
      const count = begin[f + 1] - begin[f];
      for (let i = 0; i < count; ++i) {
        this.look.array[4 * (begin[f] + i)] = 256 * (f * 0.754877666 % 1);
        this.look.array[4 * (begin[f] + i) + 1] = 255 * i / Math.max(count - 1, 1);
      }
      ends[4 * begin[f]] = 255;
      if (count >= 2) ends[4 * (begin[f + 1] - 2) + 1] = 255;
      ends[4 * (begin[f + 1] - 1) + 2] = 255;
    }

    const radii = new Float32Array(2 * this.points);
    for (let p = 0; p < this.points; ++p) radii.set(frames.radiiFrom(p), 2 * p);
    const tint = new Uint8Array(3 * this.points);
    for (let f = 0; f + 1 < begin.length; ++f) {
      const colour = frames.colourOf(f * frames.scene.fiberStep);
      for (let p = begin[f]; p < begin[f + 1]; ++p) tint.set(colour, 3 * p);
    }
    const attributes = {
      tint: new THREE.InstancedBufferAttribute(tint, 3, true, 1),
      look: new THREE.InterleavedBufferAttribute(this.look, 4, 0, true),
      lookAfter: new THREE.InterleavedBufferAttribute(this.look, 4, 4, true),
      ends: this.ends,
      radii: new THREE.InstancedBufferAttribute(radii, 2, false, 1),
    };
    ['before', 'start', 'end', 'after'].forEach((name, i) => {
      attributes[name] = new THREE.InterleavedBufferAttribute(this.buffer, 3, 3 * i);
    });
    this.uniforms = {
      pixel: {value: 0}, least: {value: 1},
      light: {value: kLight}, background: {value: new THREE.Color(kBackground)},
      nearest: {value: 0}, farthest: {value: 1},
      onlyTouching: {value: 0}, showTouching: {value: 0},
    };
    // Thick fibers are seen to touch, so they bulge; so many that they must be thin are flat.
    const across = this.points < 200000 ? [-1, -0.6, 0.6, 1] : [-1, 1];
    this.mesh = new THREE.Mesh(
        instanced(makeStrip(across), attributes, this.points),
        new THREE.RawShaderMaterial({
          vertexShader: kFiberVertex, fragmentShader: kFiberFragment,
          uniforms: this.uniforms, side: THREE.DoubleSide,
        }));
    this.mesh.frustumCulled = false;
  }

  /// @param toLight  in the scene's frame
  show(index, toLight) {
    const {points, touching} = this.frames.get(index);
    const light = lightReaching(points, this.frames.begin, toLight);
    this.buffer.array.set(points, 3);
    for (let p = 0; p < this.points; ++p) {
      this.look.array[4 * p + 2] = 255 * light[p];
      this.look.array[4 * p + 3] = touching[p >> 3] >> (p & 7) & 1 ? 255 : 0;
    }
    this.buffer.needsUpdate = true;
    this.look.needsUpdate = true;
  }

  /// Marks a fiber of those drawn, and one line of it more; null for none.
  mark(picked) {
    const ends = this.ends.array;
    for (let p = 0; p < this.points; ++p) ends[4 * p + 3] = 0;
    if (picked) {
      const first = this.frames.begin[picked.fiber], last = this.frames.begin[picked.fiber + 1];
      for (let p = first; p < last; ++p) ends[4 * p + 3] = p === first + picked.line ? 255 : 190;
    }
    this.ends.needsUpdate = true;
  }

  dispose() {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
