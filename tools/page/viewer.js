// --- The viewer ---
//
// `#scene=1&frame=20&volumes=spheres&depth=2` in the address opens such a view. The keys are those
// of kNumbers, and `volumes`, `up`, and `camera`, see parsedView().

const kBackground = 0x1d222b;
const kLight = new THREE.Vector3(-0.35, 0.75, 0.55).normalize();  // in the camera's frame
const kFramesPerSecond = 20;

/// State that is a number, with its value where the address has none. `frame` is the scene's own.
const kNumbers = {scene: 0, frame: 0, depth: 2, touching: 0, red: 0, markers: 1, bare: 0};

const kPanels = `
  <div class="panel about">
    <div class="scenes"></div>
    <h1></h1>
    <p class="counts"></p>
    <p class="drawn"></p>
  </div>
  <div class="panel show">
    <label><input type="checkbox" name="markers"> contacts</label>
    <div class="legend"><div class="scale"></div>
      <div class="row"><span>just touching</span><span class="deepest"></span></div></div>
    <label><input type="checkbox" name="red"> touching segments red</label>
    <label><input type="checkbox" name="touching"> dim all others</label>
    <div class="row"><select name="volumes" aria-label="Volumes">
      <option value="">no volumes</option><option value="boxes">boxes</option>
      <option value="spheres">spheres</option></select>
      <span class="row depth" hidden><input type="range" name="depth" min="0" step="1"
        aria-label="Depth in the tree"><output></output></span></div>
    <div class="row"><select name="up" aria-label="Axis that points up">
      <option value="x">x up</option><option value="y">y up</option>
      <option value="z">z up</option></select>
      <button name="turn" aria-pressed="false">turn</button>
      <button name="reset">reset view</button></div>
  </div>
  <div class="panel picked" role="status" hidden></div>
  <div class="panel time" hidden>
    <button name="play">play</button>
    <input type="range" name="frame" min="0" step="1" aria-label="Step"><output></output>
  </div>
  <p class="hint"></p>`;

const counted = (n, what) => `${n.toLocaleString('en-US')} ${what}${n === 1 ? '' : 's'}`;
const short = number => String(Number(number.toPrecision(3)));

/// `azimuth,elevation,zoom` in degrees, or with the target's `,x,y,z` in the file's frame; null if
/// it is neither.
function parsedView(text, middle) {
  const numbers = text.split(',').map(Number);
  if (![3, 6].includes(numbers.length) || !numbers.every(isFinite) || !(numbers[2] > 0)) return null;
  const view = {azimuth: numbers[0], elevation: numbers[1], zoom: numbers[2]};
  if (numbers.length === 6) {
    view.target = new THREE.Vector3(...numbers.slice(3).map((x, k) => x - middle[k]));
  }
  return view;
}

class Viewer {
  constructor(container, scenes) {
    this.container = container;
    this.embedded = container.dataset.embedded === 'true';
    this.scenes = scenes.map(scene => new Frames(scene));
    this.state = {...kNumbers, volumes: '', up: 'z'};

    this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: true});
    this.renderer.setClearColor(kBackground, 0);  // the style's background shows
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    container.innerHTML = kPanels;
    this.canvas = this.renderer.domElement;
    container.prepend(this.canvas);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('aria-label', 'Fibers; drag to orbit, click to ask');
    this.find('.scale').style.background = `linear-gradient(to right, ${kDepthColours.map(
        colour => `rgb(${colour.map(c => Math.round(255 * c)).join(',')})`).join(',')})`;
    this.stage = new THREE.Scene();
    this.volumes = new Volumes();
    this.stage.add(this.volumes.group);
    this.eye = new Eye(this.canvas, () => this.invalidate(), () => this.moved());
    this.connectPanels();
    this.connectMouse();
    this.openAddress();
  }

  find(selector) { return this.container.querySelector(selector); }
  input(name) { return this.find(`[name=${name}]`); }
  get frames() { return this.scenes[this.state.scene]; }

  // --- The address ---

  /// Opens what `#name=value&...` asks for, as far as it is there.
  openAddress() {
    const asked = new URLSearchParams(this.embedded ? '' : location.hash.slice(1));
    const wanted = {...kNumbers, volumes: ''};
    for (const name of Object.keys(kNumbers)) {
      if (/^\d+$/.test(asked.get(name) || '')) wanted[name] = Number(asked.get(name));
    }
    if (['boxes', 'spheres'].includes(asked.get('volumes'))) wanted.volumes = asked.get('volumes');
    if (wanted.scene >= this.scenes.length) wanted.scene = 0;
    if (!/^\d+$/.test(asked.get('frame') || '')) delete wanted.frame;
    this.container.classList.toggle('bare', wanted.bare === 1);
    this.openScene(wanted.scene);
    this.set(wanted);
    if (/^[xyz]$/.test(asked.get('up') || '')) this.setUp(asked.get('up'));
    this.view = asked.has('camera')
        ? parsedView(asked.get('camera'), this.frames.scene.middle) : null;
    this.resize();
  }

  /// Puts what is seen into the address, so that it can be opened again.
  writeAddress() {
    if (this.embedded) return;
    const scene = this.frames.scene, keys = [];
    for (const [name, usual] of Object.entries({...kNumbers, frame: scene.opened})) {
      if (this.state[name] !== usual) keys.push(`${name}=${this.state[name]}`);
    }
    if (this.state.volumes) keys.push(`volumes=${this.state.volumes}`);
    if (this.state.up !== scene.up) keys.push(`up=${this.state.up}`);
    if (this.view) {
      const {azimuth, elevation, zoom, target} = this.view;
      const numbers = [azimuth.toFixed(1), elevation.toFixed(1), short(zoom)];
      if (target) {
        numbers.push(...target.toArray().map((x, k) => Number((x + scene.middle[k]).toPrecision(6))));
      }
      keys.push(`camera=${numbers.join(',')}`);
    }
    this.written = '#' + keys.join('&');
    if (location.hash !== this.written) location.replace(this.written);
  }

  // --- Mouse, keys and panels ---

  connectPanels() {
    const tabs = this.find('.scenes');
    tabs.hidden = this.scenes.length < 2;
    this.scenes.forEach(({scene}, i) => {
      const tab = document.createElement('button');
      tab.textContent = scene.name;
      tab.addEventListener('click', () => {
        this.openScene(i);
        this.resize();
        this.writeAddress();
      });
      tabs.append(tab);
    });
    const change = changes => {
      this.set(changes);
      this.writeAddress();
    };
    for (const name of ['markers', 'red', 'touching']) {
      this.input(name).addEventListener(
          'change', event => change({[name]: event.target.checked ? 1 : 0}));
    }
    this.input('volumes').addEventListener('change', event => change({volumes: event.target.value}));
    this.input('up').addEventListener('change', event => {
      this.setUp(event.target.value);
      this.resetView();
    });
    for (const name of ['depth', 'frame']) {
      this.input(name).addEventListener('input', event => {
        if (name === 'frame') this.play(false);
        this.set({[name]: Number(event.target.value)});
      });
      this.input(name).addEventListener('change', () => this.writeAddress());
    }
    this.input('play').addEventListener('click', () => this.play(!this.playing));
    this.input('turn').addEventListener('click', () => this.turn(!this.eye.controls.autoRotate));
    this.input('reset').addEventListener('click', () => this.resetView());
    this.find('.hint').textContent = this.embedded
        ? 'drag to orbit \u00b7 click, then wheel to zoom \u00b7 right-drag to move'
        : 'drag to orbit \u00b7 wheel to zoom \u00b7 right-drag to move \u00b7 ' +
          'click a fiber or contact \u00b7 double-click to reset';
    window.addEventListener('resize', () => this.resize());
    window.addEventListener('hashchange', () => {
      if (!this.embedded && location.hash !== this.written) this.openAddress();
    });
  }

  connectMouse() {
    let pressed = null;
    this.canvas.addEventListener('webglcontextrestored', () => this.invalidate());
    this.canvas.addEventListener('dblclick', () => this.resetView());
    this.canvas.addEventListener('pointerdown', event => {
      pressed = event.button === 0 ? [event.clientX, event.clientY] : null;
    });
    this.canvas.addEventListener('pointerup', event => {
      const still = pressed &&
          Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
      if (still) this.pickAt(event.clientX, event.clientY);
    });
    window.addEventListener('keydown', event => {
      if (event.key === 'Escape') this.showPicked(null);
    });
    if (this.embedded) {
      // The wheel scrolls the page until the view has been clicked.
      this.canvas.addEventListener(
          'pointerdown', () => { this.eye.controls.enableZoom = true; });
      this.container.addEventListener(
          'mouseleave', () => { this.eye.controls.enableZoom = false; });
    }
  }

  // --- The scene and its view ---

  openScene(index) {
    this.play(false);
    this.state.scene = index;
    const frames = this.frames;
    this.state.frame = Math.min(frames.scene.opened, frames.count - 1);
    for (const old of [this.fibers, this.markers]) {
      if (!old) continue;
      this.stage.remove(old.mesh);
      old.dispose();
    }
    this.fibers = new Fibers(frames);
    this.markers = new Markers(frames);
    this.stage.add(this.fibers.mesh, this.markers.mesh);
    this.shown = null;
    this.view = null;
    const points = frames.scene.frames.map((_, i) => frames.get(i).points);
    this.framing = new Framing(points, frames.thickest);
    this.setUp(frames.scene.up);
    if (this.embedded) this.eye.controls.enableZoom = false;
    [...this.find('.scenes').children].forEach(
        (tab, i) => tab.setAttribute('aria-pressed', String(i === index)));
    this.set({});
    this.showPicked(null);
  }

  setUp(up) {
    this.state.up = up;
    this.input('up').value = up;
    this.eye.open(this.framing, up);
  }

  resetView() {
    this.view = null;
    this.look();
    this.writeAddress();
  }

  /// Light stands where the camera stands then.
  look() {
    this.eye.look(this.view || openingView(this.frames.get(this.state.frame).points, this.state.up));
    this.lookedFrom = this.eye.camera.position.clone();
    this.toLight = kLight.clone().transformDirection(this.eye.camera.matrixWorld);
    this.shown = null;
    this.set({});
  }

  /// After the mouse has moved the camera.
  moved() {
    if (this.eye.camera.position.distanceTo(this.lookedFrom) < 1e-6 * this.framing.sphere.radius) {
      return;
    }
    this.view = this.eye.view;
    this.lookedFrom = this.eye.camera.position.clone();
    this.writeAddress();
  }

  /// Changes some of the state and whatever shows it.
  set(changes) {
    const state = Object.assign(this.state, changes);
    const scene = this.frames.scene;
    state.frame = Math.max(0, Math.min(state.frame, this.frames.count - 1));
    const frame = scene.frames[state.frame];
    if (this.shown !== state.frame && this.toLight) {
      this.fibers.show(state.frame, this.toLight);
      this.markers.show(state.frame);
      this.shown = state.frame;
      if (this.picked && this.picked.marker !== undefined) this.showPicked(null);
    }
    const levels = frame.volumes[state.volumes];
    if (levels) state.depth = Math.min(state.depth, levels.length - 1);
    this.volumes.show(state.volumes, levels ? decodedFloats(levels[state.depth]) : null);
    this.fibers.uniforms.onlyTouching.value = state.touching;
    this.fibers.uniforms.showTouching.value = state.red;
    this.markers.uniforms.onlyTouching.value = state.touching;
    this.markers.mesh.visible = Boolean(state.markers);

    this.find('h1').textContent = scene.title;
    this.find('.counts').innerHTML =
        `${counted(scene.fibers, 'fiber')} \u00b7 ${counted(scene.segments, 'segment')} \u00b7 ` +
        `<span class="count">${frame.stopped ? 'more than ' : ''}` +
        `${counted(frame.contacts, 'touching pair')}</span>`;
    const marked = this.frames.get(state.frame).markers.depths.length;
    this.find('.drawn').textContent = [
      scene.drawn,
      frame.stopped ? 'the search stopped there; is the radius too large?' : '',
      marked < frame.contacts ? `the ${counted(marked, 'deepest contact')} shown` : '',
    ].filter(text => text).join(' \u00b7 ');
    this.find('.legend').hidden = !(state.markers && this.frames.deepest > 0);
    this.find('.deepest').textContent = `${short(100 * this.frames.deepest)} % of both radii deep`;
    for (const name of ['markers', 'red', 'touching']) {
      this.input(name).checked = Boolean(state[name]);
    }
    this.input('volumes').value = state.volumes;
    this.find('.depth').hidden = !levels;
    if (levels) {
      this.input('depth').max = levels.length - 1;
      this.input('depth').value = state.depth;
      this.find('.depth output').textContent = `depth ${state.depth}`;
    }
    const time = this.find('.time');
    time.hidden = this.frames.count < 2;
    this.input('frame').max = this.frames.count - 1;
    this.input('frame').value = state.frame;
    time.querySelector('output').textContent = frame.label;
    this.invalidate();
  }

  // --- Picking ---

  pickAt(clientX, clientY) {
    const {left, top} = this.canvas.getBoundingClientRect();
    this.showPicked(pick(this.eye, clientX - left, clientY - top, this.frames,
                         this.frames.get(this.state.frame), this.state.markers && this.markers));
  }

  /// @param picked  what pick() returned
  showPicked(picked) {
    this.picked = picked;
    const isFiber = picked && picked.fiber !== undefined;
    const isMarker = picked && picked.marker !== undefined;
    this.fibers.mark(isFiber ? picked : null);
    if (this.markers.picked) this.markers.mark(isMarker ? picked.marker : -1);
    const panel = this.find('.picked');
    panel.hidden = !picked;
    if (isFiber) {
      const segment = this.frames.segmentAt(picked.fiber, picked.line, picked.along);
      panel.textContent = `fiber ${picked.fiber * this.frames.scene.fiberStep}, segment ${segment}`;
    } else if (isMarker) {
      const {segments, distances, depths} = this.frames.get(this.state.frame).markers;
      const [fiberA, segmentA, fiberB, segmentB] = segments.slice(4 * picked.marker);
      const distance = distances[picked.marker];
      panel.textContent = `fiber ${fiberA}, segment ${segmentA} touches fiber ${fiberB}, ` +
          `segment ${segmentB}; ` + (distance > 0
              ? `${short(distance)} apart`
              : `${short(-distance)} deep, ${short(100 * depths[picked.marker])} % of both radii`);
    }
    this.invalidate();
  }

  // --- Time ---

  play(on) {
    if (Boolean(this.playing) === on) return;
    this.input('play').textContent = on ? 'pause' : 'play';
    if (!on) {
      clearInterval(this.playing);
      this.playing = null;
      this.writeAddress();
      return;
    }
    if (this.state.frame >= this.frames.count - 1) this.set({frame: 0});
    this.playing = setInterval(() => {
      // Once it has ended it rests.
      if (this.state.frame >= this.frames.count - 1) return this.play(false);
      this.set({frame: this.state.frame + 1});
    }, 1000 / kFramesPerSecond);
  }

  turn(on) {
    this.eye.controls.autoRotate = on;
    this.eye.controls.autoRotateSpeed = 1.2;
    this.input('turn').setAttribute('aria-pressed', String(on));
    this.invalidate();
  }

  // --- Drawing ---

  resize() {
    const {clientWidth, clientHeight} = this.container;
    const width = clientWidth || 1, height = clientHeight || 1;
    this.renderer.setSize(width, height);
    const rectangle = selector => this.find(selector).getBoundingClientRect();
    const origin = this.container.getBoundingClientRect();
    const room = {width, height, top: 0, bottom: 0};
    if (!this.state.bare) {
      room.top = rectangle('.about').bottom - origin.top;
      const lowest = [...this.container.querySelectorAll('.time, .show')]
          .map(panel => panel.getBoundingClientRect())
          .filter(panel => panel.height > 0 && panel.top > origin.top + height / 2)
          .map(panel => origin.bottom - panel.top);
      room.bottom = Math.max(40, ...lowest);
    }
    this.eye.resize(room);
    this.look();
  }

  invalidate() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.draw();
      if (this.eye.controls.autoRotate) {
        this.eye.controls.update();
        this.invalidate();
      }
    });
  }

  draw() {
    const {height} = this.canvas, ratio = this.renderer.getPixelRatio();
    const [nearest, farthest] = this.eye.clip();
    const pixel = 2 * this.eye.tangent / height;
    const fibers = this.fibers.uniforms, markers = this.markers.uniforms;
    fibers.nearest.value = nearest;
    fibers.farthest.value = farthest;
    fibers.pixel.value = markers.pixel.value = pixel;
    fibers.least.value = 1.1 * ratio;
    markers.least.value = this.markers.leastPixels * ratio;
    this.renderer.render(this.stage, this.eye.camera);
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
