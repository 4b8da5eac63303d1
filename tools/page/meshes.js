// --- Meshes: what the fibers may touch ---

/// How meshes are drawn: the values of the key `mesh`.
const kNoMesh = 0, kSolidMesh = 1, kGlassMesh = 2;

const kMeshVertex = `
  precision highp float;
  uniform mat4 modelViewMatrix, projectionMatrix;
  attribute vec3 position, normal;
  varying vec3 vPoint, vNormal;
  void main() {
    vec4 point = modelViewMatrix * vec4(position, 1.0);
    vPoint = point.xyz;
    vNormal = (modelViewMatrix * vec4(normal, 0.0)).xyz;
    gl_Position = projectionMatrix * point;
  }`;

// Glass shows most at its rims.
const kMeshFragment = `
  precision highp float;
  uniform vec3 light, background;
  uniform float nearest, farthest, glass, onlyTouching;
  varying vec3 vPoint, vNormal;
  void main() {
    vec3 eye = normalize(-vPoint), normal = normalize(vNormal);
    float facing = dot(normal, eye);
    normal *= sign(facing);
    float diffuse = 0.5 + 0.5 * dot(normal, light);
    vec3 colour = vec3(0.60, 0.63, 0.68) * (0.18 + 0.82 * diffuse * diffuse);
    colour = mix(colour, background, 0.6 * onlyTouching);
    float depth = clamp((gl_FragCoord.z / gl_FragCoord.w - nearest) / (farthest - nearest),
                        0.0, 1.0);
    float rim = pow(1.0 - abs(facing), 2.0);
    gl_FragColor = vec4(mix(colour, background, 0.42 * depth), mix(1.0, 0.16 + 0.5 * rim, glass));
  }`;

class Meshes {
  /// @param middle  of the scene, about which points are drawn
  constructor(meshes, middle) {
    this.group = new THREE.Group();
    this.names = meshes.map(mesh => mesh.name);
    this.uniforms = {
      light: {value: kLight}, background: {value: new THREE.Color(kBackground)},
      nearest: {value: 0}, farthest: {value: 1}, glass: {value: 0}, onlyTouching: {value: 0},
    };
    this.material = new THREE.RawShaderMaterial({
      vertexShader: kMeshVertex, fragmentShader: kMeshFragment, uniforms: this.uniforms,
      side: THREE.DoubleSide,
    });
    this.points = meshes.map(mesh => decodedFloats(mesh.points).map(
        (x, i) => x + mesh.middle[i % 3] - middle[i % 3]));
    meshes.forEach((mesh, m) => {
      const indexed = new THREE.BufferGeometry();
      indexed.setAttribute('position', new THREE.BufferAttribute(this.points[m], 3));
      indexed.setIndex(new THREE.BufferAttribute(decodedIntegers(mesh.triangles), 1));
      const geometry = indexed.toNonIndexed();  // triangles are flat, as fibers meet them
      geometry.computeVertexNormals();
      this.group.add(new THREE.Mesh(geometry, this.material));
    });
  }

  get any() { return this.names.length > 0; }

  show(how) {
    this.group.visible = how !== kNoMesh;
    const glass = how === kGlassMesh;
    if (glass !== this.material.transparent) this.material.needsUpdate = true;
    this.material.transparent = glass;
    this.material.depthWrite = !glass;
    this.uniforms.glass.value = glass ? 1 : 0;
  }

  /// The nearest triangle at a place of the picture, from -1 to 1; null for none.
  hitAt(camera, place) {
    if (!this.group.visible) return null;
    const ray = new THREE.Raycaster();
    ray.setFromCamera(place, camera);
    const [hit] = ray.intersectObjects(this.group.children);
    return hit ? {point: hit.point, mesh: this.group.children.indexOf(hit.object),
                  triangle: Math.floor(hit.faceIndex)} : null;
  }

  dispose() {
    for (const {geometry} of this.group.children) geometry.dispose();
    this.material.dispose();
  }
}
