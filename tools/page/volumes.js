// --- Volumes ---

const kVolumeVertex = `
  precision highp float;
  uniform mat4 modelViewMatrix, projectionMatrix;
  attribute vec3 position, center, half_;
  attribute float hue;
  varying vec3 vPoint, vNormal, vColour;
  void main() {
    vec4 point = modelViewMatrix * vec4(center + half_ * position, 1.0);
    vPoint = point.xyz;
    vNormal = (modelViewMatrix * vec4(position, 0.0)).xyz;
    vColour = 0.62 + 0.38 * cos(6.2832 * (hue + vec3(0.0, 0.33, 0.67)));
    gl_Position = projectionMatrix * point;
  }`;

// Spheres show most at their rims, as soap bubbles do.
const kVolumeFragment = `
  precision highp float;
  uniform float opacity, rim;
  varying vec3 vPoint, vNormal, vColour;
  void main() {
    float facing = abs(dot(normalize(vNormal), normalize(-vPoint)));
    gl_FragColor = vec4(vColour, mix(opacity, opacity * 0.35 + 0.75 * pow(1.0 - facing, 2.5),
                                     rim));
  }`;

class Volumes {
  constructor() {
    this.group = new THREE.Group();
    this.shapes = {
      boxes: [[new THREE.BoxBufferGeometry(2, 2, 2), 0.05, 0, false],
              [new THREE.EdgesGeometry(new THREE.BoxBufferGeometry(2, 2, 2)), 0.8, 0, true]],
      spheres: [[new THREE.SphereBufferGeometry(1, 48, 32), 0.07, 1, false]],
    };
  }

  /// @param numbers  centre and half extent of each volume, six numbers; null for none
  show(kind, numbers) {
    this.clear();
    if (!numbers) return;
    const count = numbers.length / 6;
    const buffer = new THREE.InstancedInterleavedBuffer(numbers, 6, 1);
    const hues = new Float32Array(count).map((_, i) => (0.08 + 0.618034 * i) % 1);
    const attributes = {
      center: new THREE.InterleavedBufferAttribute(buffer, 3, 0),
      half_: new THREE.InterleavedBufferAttribute(buffer, 3, 3),
      hue: new THREE.InstancedBufferAttribute(hues, 1, false, 1),
    };
    for (const [shape, opacity, rim, lines] of this.shapes[kind]) {
      const material = new THREE.RawShaderMaterial({
        vertexShader: kVolumeVertex, fragmentShader: kVolumeFragment,
        uniforms: {opacity: {value: opacity / Math.pow(count, 0.15)}, rim: {value: rim}},
        transparent: true, depthWrite: false, side: rim ? THREE.FrontSide : THREE.DoubleSide,
      });
      const geometry = instanced(shape, attributes, count);
      const mesh = lines ? new THREE.LineSegments(geometry, material)
                         : new THREE.Mesh(geometry, material);
      mesh.frustumCulled = false;
      this.group.add(mesh);
    }
  }

  clear() {
    for (const mesh of this.group.children.slice()) {
      this.group.remove(mesh);
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}
