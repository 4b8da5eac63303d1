// --- The viewer ---

const kBackground = 0x1d222b;
const kLight = new THREE.Vector3(-0.35, 0.75, 0.55).normalize();  // in the camera's frame
const kFramesPerSecond = 20;

const kPanels = `
  <div class="panel about">
    <div class="scenes"></div>
    <h1></h1>
    <p class="counts"></p>
    <p class="drawn"></p>
    <p class="picked" role="status" hidden></p>
  </div>
  <div class="panel show">
    <label><input type="checkbox" name="markers"> contacts</label>
    <div class="legend"><div class="scale"></div>
      <div class="row"><span>touching</span><span class="deepest"></span></div></div>
    <label><input type="checkbox" name="red"> touching segments red</label>
    <label><input type="checkbox" name="touching"> dim all others</label>
    <div class="row volumes"><select name="volumes" aria-label="Volumes">
      <option value="">no volumes</option><option value="boxes">boxes</option>
      <option value="spheres">spheres</option></select>
      <span class="row depth" hidden><input type="range" name="depth" min="0" step="1"
        aria-label="Depth in the tree"><output></output></span></div>
    <div class="row"><select name="up" aria-label="Axis that points up">
      <option value="x">x up</option><option value="y">y up</option>
      <option value="z">z up</option></select>
      <button name="turn" aria-pressed="false">turn</button>
      <button name="reset">reset</button></div>
  </div>
  <div class="panel time" hidden>
    <button name="play">play</button>
    <input type="range" name="frame" min="0" step="1" aria-label="Step"><output></output>
  </div>
  <p class="hint"></p>`;

const counted = (n, what) => `${n.toLocaleString('en-US')} ${what}${n === 1 ? '' : 's'}`;

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

  openAddress() {
    const asked = askedBy(this.embedded ? '' : location.hash);
    const {scene, frame} = asked.numbers;
    this.openScene(scene < this.scenes.length ? scene : 0);
    const opened = asked.frameIsGiven ? frame : this.frames.scene.opened;
    this.set({...asked.numbers, scene: this.state.scene, frame: opened, volumes: asked.volumes});
    this.container.classList.toggle('bare', this.state.bare === 1);
    if (asked.up) this.setUp(asked.up);
    this.view = parsedView(asked.camera, this.frames.scene.middle);
    this.resize();
  }

  /// Puts what is seen into the address, so that it can be opened again.
  writeAddress() {
    if (this.embedded) return;
    this.written = '#' + addressOf(this.state, this.view, this.frames.scene);
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
    this.input('volumes').addEventListener(
        'change', event => change({volumes: event.target.value}));
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
    const opened = this.frames.get(this.frames.scene.opened).points;
    const opening = openingView(opened, this.state.up);
    this.eye.chooseRoom(this.rooms, opening);
    this.eye.look(this.view || opening);
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
    this.find('.deepest').textContent = `${short(100 * this.frames.deepest)} % of the radii's sum`;
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
              : `${short(-distance)} deep, ${short(100 * depths[picked.marker])} % of the radii's sum`);
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
    const bare = {width, height, top: 0, left: 0, right: 0, bottom: 0};
    this.rooms = [bare];
    if (!this.state.bare) {
      const show = rectangle('.show'), time = rectangle('.time');
      const isBelow = show.top > origin.top + height / 2;
      const lowest = isBelow ? show.top : time.height ? time.top : origin.bottom - 40;
      const room = {...bare, top: rectangle('.about').bottom - origin.top,
                    bottom: origin.bottom - lowest};
      const right = origin.right - show.left;
      this.rooms = isBelow ? [room] : [
        {...room, left: right, right},
        {...room, top: Math.max(room.top, show.bottom - origin.top)},
        {...room, right},
      ];
    }
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
