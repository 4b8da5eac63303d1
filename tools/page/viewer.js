// SPDX-License-Identifier: BSD-3-Clause
//
// Draws the scenes that page.cpp wrote into the page: fibers as ribbons that face the camera, as
// thick as they are but never thinner than a pixel; touching segments red; volumes on request.
// `#scene=1&frame=20&volumes=spheres&depth=2&touching=1` in the address opens such a view.
(function () {
  'use strict';

  const kBackground = 0x1d222b;
  const kLight = new THREE.Vector3(-0.35, 0.75, 0.55).normalize();  // in the camera's frame
  const kFramesPerSecond = 20;

  // --- Data ---

  function bytesOf(base64) {
    const text = atob(base64);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    return bytes;
  }

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

  function decodedFloats(base64) {
    const view = new DataView(bytesOf(base64).buffer);
    const numbers = new Float32Array(view.byteLength / 4);
    for (let i = 0; i < numbers.length; ++i) numbers[i] = view.getFloat32(4 * i, true);
    return numbers;
  }

  class Frames {
    constructor(scene) {
      this.scene = scene;
      const begin = new DataView(bytesOf(scene.begin).buffer);
      this.begin = new Uint32Array(begin.byteLength / 4);
      for (let f = 0; f < this.begin.length; ++f) this.begin[f] = begin.getUint32(4 * f, true);
      this.cache = new Map();
    }
    get(index) {
      if (!this.cache.has(index)) {
        const frame = this.scene.frames[index];
        this.cache.set(index, {
          points: decodedPoints(this.scene, frame),
          touching: bytesOf(frame.touching),
          contacts: frame.contacts,
        });
      }
      return this.cache.get(index);
    }
  }

  // --- Light that comes through the fibers in front ---

  /// For each point the share of light that reaches it, from fiber length per cell of a grid summed
  /// up towards the light.
  function lightReaching(points, begin, toLight) {
    const n = 40;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < points.length; ++i) {
      low[i % 3] = Math.min(low[i % 3], points[i]);
      high[i % 3] = Math.max(high[i % 3], points[i]);
    }
    const size = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2]) || 1;
    const cell = 1.0001 * size / n;
    const density = new Float32Array(n * n * n);
    const cellOf = (x, y, z) => x + n * (y + n * z);
    const cellAt = i => cellOf(Math.floor((points[i] - low[0]) / cell),
                               Math.floor((points[i + 1] - low[1]) / cell),
                               Math.floor((points[i + 2] - low[2]) / cell));
    let total = 0;
    for (let f = 0; f + 1 < begin.length; ++f) {
      for (let p = begin[f]; p + 1 < begin[f + 1]; ++p) {
        const i = 3 * p;
        const length = Math.hypot(points[i + 3] - points[i], points[i + 4] - points[i + 1],
                                  points[i + 5] - points[i + 2]);
        density[cellAt(i)] += length;
        total += length;
      }
    }
    let filled = 0;
    for (const d of density) filled += d > 0 ? 1 : 0;
    const usual = total / Math.max(filled, 1);
    const step = [toLight.x, toLight.y, toLight.z];
    const passed = new Float32Array(density.length).fill(-1);
    const lightAt = c => {
      if (passed[c] >= 0) return passed[c];
      let x = c % n + 0.5, y = Math.floor(c / n) % n + 0.5, z = Math.floor(c / n / n) + 0.5;
      let sum = -0.5 * density[c];
      for (let k = 0; k < 1.8 * n; ++k) {
        if (x < 0 || y < 0 || z < 0 || x >= n || y >= n || z >= n) break;
        sum += density[cellOf(Math.floor(x), Math.floor(y), Math.floor(z))];
        x += step[0]; y += step[1]; z += step[2];
      }
      return passed[c] = Math.exp(-0.16 * Math.max(sum, 0) / usual);
    };
    const light = new Float32Array(points.length / 3);
    for (let p = 0; p < light.length; ++p) light[p] = lightAt(cellAt(3 * p));
    return light;
  }

  // --- Fibers ---

  // The points before and after a segment turn its ends, so that ribbons meet without a gap.
  const kFiberVertex = `
    precision highp float;
    uniform mat4 modelViewMatrix, projectionMatrix;
    uniform float pixel, least, onlyTouching;
    attribute vec2 position;  // x across, y from start to end
    attribute vec3 before, start, end, after;
    attribute float radius;
    attribute vec4 look;      // hue of the fiber, place along it, light, touching
    attribute vec4 ends;      // whether the fiber begins, ends, has ended before; and nothing
    varying vec3 vTangent, vSide, vEye;
    varying vec4 vLook;
    varying float vAcross;
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
      vec3 tangent = position.y < 0.5 ? (ends.x > 0.5 ? along : directed(a - earlier, along) + along)
                                      : (ends.y > 0.5 ? along : directed(later - b, along) + along);
      tangent = directed(tangent, along);
      vec3 point = mix(a, b, position.y);
      vec3 eye = normalize(-point);
      vec3 side = directed(cross(tangent, eye), vec3(0.0, 1.0, 0.0));
      float touching = look.w;
      float thin = 0.5 * (least + 0.7 * touching) * pixel * -point.z;
      point += position.x * max(radius, thin) * side;
      vTangent = tangent; vSide = side; vEye = eye; vLook = look; vAcross = position.x;
      gl_Position = projectionMatrix * vec4(point, 1.0);
      gl_Position.z -= 2e-5 * touching * gl_Position.w;
      // What touches may be deep inside: with the others dimmed it is drawn before them.
      if (touching * onlyTouching > 0.5) gl_Position.z = 0.01 * gl_Position.z - 0.98 * gl_Position.w;
    }`;

  // Kajiya and Kay's hair: light scattered across the tangent, and two highlights along it.
  const kFiberFragment = `
    precision highp float;
    uniform vec3 light, background, dark, bright;
    uniform float nearest, farthest, onlyTouching, showTouching;
    varying vec3 vTangent, vSide, vEye;
    varying vec4 vLook;
    varying float vAcross;
    void main() {
      vec3 t = normalize(vTangent);
      vec3 normal = normalize(vSide) * vAcross + vEye * sqrt(max(1.0 - vAcross * vAcross, 0.0));
      vec3 hue = mix(dark, bright, clamp(vLook.x * 0.85 + 0.25 * vLook.y - 0.05, 0.0, 1.0));
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
      if (onlyTouching > 0.5) colour = mix(colour, background, 0.82);
      colour = mix(colour, vec3(1.0, 0.16, 0.11) * (0.72 + 0.28 * max(dot(normal, light), 0.0)),
                   touching);
      float depth = clamp((gl_FragCoord.z / gl_FragCoord.w - nearest) / (farthest - nearest),
                          0.0, 1.0);
      gl_FragColor = vec4(mix(colour, background, (0.42 - 0.2 * touching) * depth), 1.0);
    }`;

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
      const begin = frames.begin;
      this.frames = frames;
      this.points = begin[begin.length - 1];
      // One point before the first and two after the last, so that all four are inside the buffer.
      this.buffer =
          new THREE.InstancedInterleavedBuffer(new Float32Array(3 * (this.points + 3)), 3, 1);
      this.look =
          new THREE.InstancedBufferAttribute(new Uint8Array(4 * this.points), 4, true, 1);
      const ends = new Uint8Array(4 * this.points);
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

      const quad = new THREE.BufferGeometry();
      quad.setIndex([0, 1, 2, 2, 1, 3]);
      quad.setAttribute('position', new THREE.BufferAttribute(
          new Float32Array([-1, 0, 1, 0, -1, 1, 1, 1]), 2));
      const radii = decodedFloats(frames.scene.radii);
      this.thickest = radii.reduce((a, b) => Math.max(a, b));
      const radiusOfAll = new Float32Array(this.points).map((_, p) => radii[p % radii.length]);
      const attributes = {
        look: this.look,
        ends: new THREE.InstancedBufferAttribute(ends, 4, true, 1),
        radius: new THREE.InstancedBufferAttribute(radiusOfAll, 1, false, 1),
      };
      ['before', 'start', 'end', 'after'].forEach((name, i) => {
        attributes[name] = new THREE.InterleavedBufferAttribute(this.buffer, 3, 3 * i);
      });
      this.uniforms = {
        pixel: {value: 0}, least: {value: 1},
        light: {value: kLight}, background: {value: new THREE.Color(kBackground)},
        dark: {value: new THREE.Color(0x6b4526)}, bright: {value: new THREE.Color(0xe3bd86)},
        nearest: {value: 0}, farthest: {value: 1},
        onlyTouching: {value: 0}, showTouching: {value: 1},
      };
      this.mesh = new THREE.Mesh(
          instanced(quad, attributes, this.points),
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

    dispose() {
      this.mesh.geometry.dispose();
      this.mesh.material.dispose();
    }
  }

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

  // --- Where to look from ---

  /// The direction along which the points vary least, by power iteration on what is left of the
  /// trace; towards +x, +y, +z rather than away.
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
    return v.dot(new THREE.Vector3(1, -0.4, 0.5)) < 0 ? v.negate() : v;
  }

  // --- The viewer ---

  const kPanels = `
    <div class="panel about">
      <div class="scenes"></div>
      <h1></h1>
      <p class="counts"></p>
      <p class="drawn"></p>
    </div>
    <div class="panel show">
      <label><input type="checkbox" name="red" checked> touching segments red</label>
      <label><input type="checkbox" name="touching"> dim all others</label>
      <div class="row"><select name="volumes" aria-label="Volumes">
        <option value="">no volumes</option><option value="boxes">boxes</option>
        <option value="spheres">spheres</option></select>
        <span class="row depth" hidden><input type="range" name="depth" min="0" step="1"
          aria-label="Depth in the tree"><output></output></span></div>
      <div class="row"><button name="turn" aria-pressed="false">turn</button>
        <button name="reset">reset view</button></div>
    </div>
    <div class="panel time" hidden>
      <button name="play">play</button>
      <input type="range" name="frame" min="0" step="1" aria-label="Step"><output></output>
    </div>
    <p class="hint"></p>`;

  class Viewer {
    constructor(container, scenes) {
      this.container = container;
      this.embedded = container.dataset.embedded === 'true';
      this.scenes = scenes.map(scene => new Frames(scene));
      this.state = {scene: 0, frame: 0, volumes: '', depth: 2, touching: 0, red: 1};

      this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: true});
      this.renderer.setClearColor(kBackground, 0);  // the style's background shows
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      container.innerHTML = kPanels;
      container.prepend(this.renderer.domElement);
      this.renderer.domElement.tabIndex = 0;
      this.renderer.domElement.setAttribute('aria-label', 'Fibers; drag to orbit');
      this.stage = new THREE.Scene();
      this.volumes = new Volumes();
      this.stage.add(this.volumes.group);
      this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
      this.camera.up.set(0, 0, 1);
      this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
      this.controls.rotateSpeed = 0.8;
      this.controls.addEventListener('change', () => this.invalidate());
      this.connectPanels();
      window.addEventListener('resize', () => this.resize());
      this.renderer.domElement.addEventListener('webglcontextrestored', () => this.invalidate());

      const wanted = this.embedded ? {} : this.wantedByAddress();
      this.openScene(wanted.scene || 0);
      this.set(wanted);
      this.resize();
    }

    find(selector) { return this.container.querySelector(selector); }
    input(name) { return this.find(`[name=${name}]`); }
    get frames() { return this.scenes[this.state.scene]; }

    /// What `#name=value&...` asks for, as far as it is there.
    wantedByAddress() {
      const wanted = {};
      for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
        if (name === 'volumes' && ['', 'boxes', 'spheres'].includes(value)) wanted[name] = value;
        if (['scene', 'frame', 'depth', 'touching', 'red'].includes(name) &&
            /^\d+$/.test(value)) {
          wanted[name] = Number(value);
        }
      }
      if (wanted.scene >= this.scenes.length) delete wanted.scene;
      return wanted;
    }

    connectPanels() {
      const tabs = this.find('.scenes');
      tabs.hidden = this.scenes.length < 2;
      this.scenes.forEach(({scene}, i) => {
        const tab = document.createElement('button');
        tab.textContent = scene.name;
        tab.addEventListener('click', () => this.openScene(i));
        tabs.append(tab);
      });
      for (const name of ['red', 'touching']) {
        this.input(name).addEventListener(
            'change', event => this.set({[name]: event.target.checked ? 1 : 0}));
      }
      this.input('volumes').addEventListener(
          'change', event => this.set({volumes: event.target.value}));
      for (const name of ['depth', 'frame']) {
        this.input(name).addEventListener('input', event => {
          if (name === 'frame') this.play(false);
          this.set({[name]: Number(event.target.value)});
        });
      }
      this.input('play').addEventListener('click', () => this.play(!this.playing));
      this.input('turn').addEventListener('click', () => this.turn(!this.controls.autoRotate));
      this.input('reset').addEventListener('click', () => this.resetView());
      this.renderer.domElement.addEventListener('dblclick', () => this.resetView());
      this.find('.hint').textContent = this.embedded
          ? 'drag to orbit \u00b7 click, then wheel to zoom \u00b7 right-drag to move'
          : 'drag to orbit \u00b7 wheel to zoom \u00b7 right-drag to move \u00b7 double-click to reset';
      if (this.embedded) {
        // The wheel scrolls the page until the view has been clicked.
        this.controls.enableZoom = false;
        this.renderer.domElement.addEventListener(
            'pointerdown', () => { this.controls.enableZoom = true; });
        this.container.addEventListener(
            'mouseleave', () => { this.controls.enableZoom = false; });
      }
    }

    openScene(index) {
      this.play(false);
      this.state.scene = index;
      this.state.frame = Math.min(this.frames.scene.opened || 0,
                                  this.frames.scene.frames.length - 1);
      if (this.fibers) {
        this.stage.remove(this.fibers.mesh);
        this.fibers.dispose();
      }
      this.fibers = new Fibers(this.frames);
      this.stage.add(this.fibers.mesh);

      // Of all frames, so that nothing leaves the picture as it plays.
      this.samples = [];
      const count = this.frames.scene.frames.length, step = Math.ceil(count * this.fibers.points / 2e4);
      for (let i = 0; i < count; ++i) {
        const points = this.frames.get(i).points;
        for (let p = 0; p < this.fibers.points; p += step) {
          this.samples.push(new THREE.Vector3(points[3 * p], points[3 * p + 1], points[3 * p + 2]));
        }
      }
      this.bounds = new THREE.Box3().setFromPoints(this.samples)
          .getBoundingSphere(new THREE.Sphere());
      if (!(this.bounds.radius > 0)) this.bounds.radius = this.fibers.thickest || 1;
      this.resetView();
      [...this.find('.scenes').children].forEach(
          (tab, i) => tab.setAttribute('aria-pressed', String(i === index)));
      this.set({});
    }

    resetView() {
      const toEye = flattestDirection(this.frames.get(this.state.frame).points);
      toEye.z = Math.max(toEye.z, -0.5);
      if (Math.abs(toEye.z) < 0.25) toEye.z += 0.22;
      toEye.normalize();
      const right = new THREE.Vector3(0, 0, 1).cross(toEye).normalize();
      const up = toEye.clone().cross(right);
      // In the middle of what is seen from there, and as near as all points of all frames, or
      // enough of them, allow; with room for the panels.
      const seen = this.samples.map(p => [p.dot(right), p.dot(up), p.dot(toEye)]);
      const middleOf = k => {
        const numbers = seen.map(p => p[k]);
        return (Math.min(...numbers) + Math.max(...numbers)) / 2;
      };
      const middle = [0, 1, 2].map(middleOf);
      const tangent = Math.tan(THREE.Math.degToRad(this.camera.fov / 2));
      const width = this.container.clientWidth || 1, height = this.container.clientHeight || 1;
      const wide = tangent * width / height * 0.94;
      const room = this.frames.scene.frames.length > 1 ? 220 : 150;
      const high = tangent * Math.max(1 - room / height, 0.6);
      let distance = 0;
      for (const p of seen) {
        const off = Math.max(Math.abs(p[0] - middle[0]) / wide, Math.abs(p[1] - middle[1]) / high);
        distance = Math.max(distance, p[2] - middle[2] + off);
      }
      distance = Math.max(distance, 1e-3 * this.bounds.radius);
      this.controls.target.set(0, 0, 0).addScaledVector(right, middle[0])
          .addScaledVector(up, middle[1]).addScaledVector(toEye, middle[2]);
      this.camera.position.copy(this.controls.target).addScaledVector(toEye, distance);
      this.controls.minDistance = 1e-3 * this.bounds.radius;
      this.controls.maxDistance = 20 * this.bounds.radius;
      this.controls.update();
      this.relight();
      this.invalidate();
    }

    /// Light stands where the camera stood when the view was last reset.
    relight() {
      this.camera.updateMatrixWorld();
      this.toLight = kLight.clone().transformDirection(this.camera.matrixWorld);
      this.lit = null;
    }

    /// Changes some of the state and whatever shows it.
    set(changes) {
      const state = Object.assign(this.state, changes);
      const scene = this.frames.scene;
      state.frame = Math.max(0, Math.min(state.frame, scene.frames.length - 1));
      const frame = scene.frames[state.frame];
      if (this.lit !== state.frame) {
        this.fibers.show(state.frame, this.toLight);
        this.lit = state.frame;
      }
      const levels = frame.volumes && frame.volumes[state.volumes];
      if (levels) state.depth = Math.min(state.depth, levels.length - 1);
      this.volumes.show(state.volumes, levels ? decodedFloats(levels[state.depth]) : null);
      this.fibers.uniforms.onlyTouching.value = state.touching;
      this.fibers.uniforms.showTouching.value = state.red;

      const counted = (n, what) => `${n.toLocaleString('en-US')} ${what}${n === 1 ? '' : 's'}`;
      this.find('h1').textContent = scene.title;
      this.find('.counts').innerHTML =
          `${counted(scene.fibers, 'fiber')} \u00b7 ${counted(scene.segments, 'segment')}` +
          ` \u00b7 <span class="count">${counted(frame.contacts, 'touching pair')}</span>`;
      this.find('.drawn').textContent = scene.drawn;
      this.input('red').checked = Boolean(state.red);
      this.input('touching').checked = Boolean(state.touching);
      const select = this.input('volumes');
      select.value = state.volumes;
      for (const option of select.options) {
        option.disabled = option.value !== '' && !(frame.volumes && frame.volumes[option.value]);
      }
      this.find('.depth').hidden = !levels;
      if (levels) {
        this.input('depth').max = levels.length - 1;
        this.input('depth').value = state.depth;
        this.find('.depth output').textContent = `depth ${state.depth}`;
      }
      const time = this.find('.time');
      time.hidden = scene.frames.length < 2;
      this.input('frame').max = scene.frames.length - 1;
      this.input('frame').value = state.frame;
      time.querySelector('output').textContent = frame.label;
      this.invalidate();
    }

    play(on) {
      if (Boolean(this.playing) === on) return;
      this.input('play').textContent = on ? 'pause' : 'play';
      if (!on) {
        clearInterval(this.playing);
        this.playing = null;
        return;
      }
      const last = () => this.frames.scene.frames.length - 1;
      if (this.state.frame >= last()) this.set({frame: 0});
      this.playing = setInterval(() => {
        // Once it has ended it rests.
        if (this.state.frame >= last()) return this.play(false);
        this.set({frame: this.state.frame + 1});
      }, 1000 / kFramesPerSecond);
    }

    turn(on) {
      this.controls.autoRotate = on;
      this.controls.autoRotateSpeed = 1.2;
      this.input('turn').setAttribute('aria-pressed', String(on));
      this.invalidate();
    }

    resize() {
      const width = this.container.clientWidth || 1, height = this.container.clientHeight || 1;
      this.renderer.setSize(width, height);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      if (!this.sized) this.resetView();
      this.sized = true;
      this.set({});
    }

    invalidate() {
      if (this.pending) return;
      this.pending = true;
      requestAnimationFrame(() => {
        this.pending = false;
        this.draw();
        if (this.controls.autoRotate) {
          this.controls.update();
          this.invalidate();
        }
      });
    }

    draw() {
      const distance = this.camera.position.distanceTo(this.bounds.center);
      const r = 1.05 * this.bounds.radius;
      this.camera.near = Math.max(distance - 2 * r, 2e-4 * r);
      this.camera.far = distance + 2 * r;
      this.camera.updateProjectionMatrix();
      const uniforms = this.fibers.uniforms;
      uniforms.nearest.value = Math.max(distance - r, 0);
      uniforms.farthest.value = distance + r;
      uniforms.pixel.value = 2 * Math.tan(THREE.Math.degToRad(this.camera.fov / 2)) /
          this.renderer.domElement.height;
      uniforms.least.value = this.renderer.getPixelRatio() * 1.1;
      this.renderer.render(this.stage, this.camera);
      this.container.dataset.state = 'drawn';
    }
  }

  for (const container of document.querySelectorAll('.fiber-viewer')) {
    if (container.dataset.state) continue;  // of another fragment, whose script has run
    const data = JSON.parse(container.nextElementSibling.textContent);
    try {
      container.viewer = new Viewer(container, data.scenes);
    } catch (error) {
      container.dataset.state = 'failed';
      container.innerHTML = '<div class="failure"></div>';
      container.firstChild.textContent =
          `This view needs WebGL, which this browser does not give: ${error.message}`;
    }
  }
})();
