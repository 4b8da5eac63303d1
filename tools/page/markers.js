// --- Markers: a disc at each contact, midway between the two surfaces, coloured by depth ---

// Colours run from the shallowest contact to the deepest; none is one of hair. Between fibers, depth
// is relative to the radii; in a mesh it is a length.
const kFiberContacts = {
  name: 'markers',
  colours: [[0.20, 0.85, 1.00], [0.75, 0.45, 1.00], [1.00, 0.16, 0.30]],
  depthText: depth => `${short(100 * depth)} % of the radii's sum`,
};
const kMeshContacts = {
  name: 'meshmarkers',
  colours: [[0.80, 1.00, 0.55], [0.30, 0.95, 0.35], [0.00, 0.70, 0.25]],
  depthText: depth => `${short(depth)} deep`,
};
const kContacts = [kFiberContacts, kMeshContacts];

const kMarkerVertex = `
  precision highp float;
  uniform mat4 modelViewMatrix, projectionMatrix;
  uniform float pixel, least, size, lift, onlyTouching;
  attribute vec2 position;
  attribute vec3 place, colour;
  attribute float picked;
  varying vec2 vCorner;
  varying vec3 vColour;
  void main() {
    vCorner = vec2(position.x, 2.0 * position.y - 1.0);
    vec4 centre = modelViewMatrix * vec4(place, 1.0);
    float radius = max(size, least * pixel * -centre.z) * (1.0 + 0.8 * picked);
    gl_Position = projectionMatrix * (centre + vec4(radius * vCorner, 0.0, 0.0));
    // The contact is inside both fibers, so it shows through the one in front.
    vec4 lifted = projectionMatrix *
        vec4(centre.xyz + (lift + radius) * normalize(-centre.xyz), 1.0);
    gl_Position.z = lifted.z / lifted.w * gl_Position.w;
    if (onlyTouching > 0.5) gl_Position.z = 0.01 * gl_Position.z - 0.985 * gl_Position.w;
    vColour = mix(colour, vec3(1.0), picked);
  }`;

const kMarkerFragment = `
  precision highp float;
  varying vec2 vCorner;
  varying vec3 vColour;
  void main() {
    float across = dot(vCorner, vCorner);
    if (across > 1.0) discard;
    gl_FragColor = vec4(vColour * (across > 0.6 ? 0.45 : 1.05 - 0.35 * across), 1.0);
  }`;

/// @param depth  from 0 to 1, the deepest of the scene
function depthColour(depth, colours) {
  const at = 2 * Math.min(Math.max(depth, 0), 1), k = Math.min(Math.floor(at), 1);
  return colours[k].map((c, i) => c + (colours[k + 1][i] - c) * (at - k));
}

class Markers {
  constructor(frames, kind) {
    this.frames = frames;
    this.kind = kind;
    this.deepest = frames.deepest(kind.name);
    this.uniforms = {
      pixel: {value: 0}, least: {value: 1}, onlyTouching: {value: 0},
      size: {value: 0.6 * frames.thickest}, lift: {value: 2 * frames.thickest},
    };
    this.mesh = new THREE.Mesh(undefined, new THREE.RawShaderMaterial({
      vertexShader: kMarkerVertex, fragmentShader: kMarkerFragment, uniforms: this.uniforms,
    }));
    this.mesh.frustumCulled = false;
  }

  show(index) {
    this.shown = this.frames.get(index)[this.kind.name];
    const {places, depths} = this.shown;
    const count = this.count = depths.length, colours = new Float32Array(3 * count);
    depths.forEach((depth, i) => {
      colours.set(depthColour(depth / (this.deepest || 1), this.kind.colours), 3 * i);
    });
    this.picked = new THREE.InstancedBufferAttribute(new Float32Array(count), 1, false, 1);
    this.mesh.geometry.dispose();
    this.mesh.geometry = instanced(makeStrip([-1, 1]), {
      place: new THREE.InstancedBufferAttribute(places, 3, false, 1),
      colour: new THREE.InstancedBufferAttribute(colours, 3, false, 1),
      picked: this.picked,
    }, count);
    // Pixels of the screen. Many markers would hide the fibers.
    this.leastPixels = Math.min(Math.max(6 - 1.1 * Math.log10(Math.max(count, 1)), 1.2), 5);
  }

  mark(index) {
    if (!this.picked) return;
    this.picked.array.fill(0);
    if (index >= 0) this.picked.array[index] = 1;
    this.picked.needsUpdate = true;
  }

  dispose() {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
