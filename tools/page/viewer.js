// --- The viewer ---

const kBackground = 0x1d222b;
const kLight = new THREE.Vector3(-0.35, 0.75, 0.55).normalize();  // in the camera's frame
const kFramesPerSecond = 20;

class Viewer {
  constructor(container, {scenes, meshes}) {
    this.container = container;
    const isPart = container.dataset.embedded === 'true';
    this.embedded = isPart || window.parent !== window;
    // A frame's srcdoc has none: an address that is written there would open the page around it.
    this.hasAddress = !isPart && location.protocol !== 'about:';
    this.scenes = scenes.map(scene => new Frames(scene));
    this.meshData = meshes;
    this.state = {...kNumbers, volumes: '', up: 'z'};

    this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: true});
    this.renderer.setClearColor(kBackground, 0);  // the style's background shows
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    container.innerHTML = kPanels;
    this.canvas = this.renderer.domElement;
    container.prepend(this.canvas);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('aria-label', 'Fibers; drag to orbit, click to ask');
    for (const {name, colours} of kContacts) {
      const colour = colours.map(c => `rgb(${c.map(x => Math.round(255 * x)).join(',')})`);
      this.find(`.of-${name} .scale`).style.background = `linear-gradient(to right, ${colour})`;
    }
    this.container.querySelectorAll('.of-mesh').forEach(
        panel => { panel.hidden = meshes.length === 0; });
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
    const asked = askedBy(this.hasAddress ? location.hash : '');
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
    if (!this.hasAddress) return;
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
    for (const name of ['markers', 'meshmarkers', 'red', 'touching']) {
      this.input(name).addEventListener(
          'change', event => change({[name]: event.target.checked ? 1 : 0}));
    }
    this.input('volumes').addEventListener(
        'change', event => change({volumes: event.target.value}));
    this.input('mesh').addEventListener(
        'change', event => change({mesh: Number(event.target.value)}));
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
      if (this.hasAddress && location.hash !== this.written) this.openAddress();
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
      const still = pressed && event.button === 0 &&
          Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
      pressed = null;
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
    for (const old of this.drawn || []) {
      this.stage.remove(old.mesh || old.group);
      old.dispose();
    }
    this.fibers = new Fibers(frames);
    this.markers = kContacts.map(kind => new Markers(frames, kind));
    this.meshes = new Meshes(this.meshData, frames.scene.middle);
    this.drawn = [this.fibers, ...this.markers, this.meshes];
    const {guide, middle} = frames.scene;
    this.guide = guide ? new Guide(this, guide, middle) : null;
    if (guide) this.drawn.push(this.guide);
    this.stage.add(...this.drawn.map(drawn => drawn.mesh || drawn.group));
    this.shown = null;
    this.view = null;
    const points = frames.scene.frames.map((_, i) => frames.get(i).points);
    if (guide) points.push(this.guide.extent);
    this.framing = new Framing([...points, ...this.meshes.points], frames.thickest);
    this.setUp(frames.scene.up);
    if (this.embedded) this.eye.controls.enableZoom = false;
    this.find('.groups').replaceChildren(...frames.scene.groups.map(({name, fibers}, i) => {
      const line = document.createElement('div'), colour = document.createElement('i');
      colour.style.background = `rgb(${frames.colourOfGroup(i + 1)})`;
      line.append(colour, `${name}: ${counted(fibers, 'fiber')}`);
      return line;
    }));
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
      this.markers.forEach(markers => markers.show(state.frame));
      this.shown = state.frame;
      if (this.picked && this.picked.marker !== undefined) this.showPicked(null);
    }
    const levels = frame.volumes[state.volumes];
    if (levels) state.depth = Math.min(state.depth, levels.length - 1);
    this.volumes.show(state.volumes, levels ? decodedFloats(levels[state.depth]) : null);
    this.fibers.uniforms.showTouching.value = state.red;
    for (const {uniforms} of this.drawn) uniforms.onlyTouching.value = state.touching;
    this.meshes.show(state.mesh);
    for (const markers of this.markers) {
      const {name, depthText} = markers.kind;
      const isShown = markers.mesh.visible = Boolean(state[name]);
      this.find(`.of-${name}`).hidden = !(isShown && markers.deepest > 0);
      this.find(`.of-${name} .deepest`).textContent = depthText(markers.deepest);
    }

    this.find('h1').textContent = scene.title;
    this.find('.counts').innerHTML =
        `${counted(scene.fibers, 'fiber')} \u00b7 ${counted(scene.segments, 'segment')} \u00b7 ` +
        `<span class="count">${frame.stopped ? 'more than ' : ''}` +
        `${counted(frame.contacts, contactsName(scene))}</span>` +
        (scene.impacts === null ? '' :
            `${state.frame === 0 ? ' at the start' : ' since the instant before'}, ` +
            `${scene.impacts.toLocaleString('en-US')} in the step`) +
        (this.meshes.any ? `, <span class="count of-mesh">${
            frame.meshContacts.toLocaleString('en-US')} with meshes</span>` : '');
    const shown = this.markers.reduce((sum, markers) => sum + markers.count, 0);
    const contacts = frame.contacts + frame.meshContacts;
    this.find('.drawn').textContent = [
      scene.drawn,
      frame.stopped ? 'the search stopped there; is the radius too large?' : '',
      shown < contacts ? `the ${counted(shown, 'deepest contact')} shown` : '',
    ].filter(text => text).join(' \u00b7 ');
    for (const name of ['markers', 'meshmarkers', 'red', 'touching']) {
      this.input(name).checked = Boolean(state[name]);
    }
    this.input('mesh').value = state.mesh;
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
                         this.frames.get(this.state.frame), this.markers, this.meshes));
  }

  /// @param picked  what pick() returned
  showPicked(picked) {
    this.picked = picked;
    this.fibers.mark(picked && picked.fiber !== undefined ? picked : null);
    for (const markers of this.markers) {
      markers.mark(picked && picked.markers === markers ? picked.marker : -1);
    }
    const panel = this.find('.picked');
    panel.hidden = !picked;
    if (picked) panel.textContent = pickedText(picked, this.frames, this.meshes);
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
    for (const {uniforms} of [this.fibers, this.meshes]) {
      uniforms.nearest.value = nearest;
      uniforms.farthest.value = farthest;
    }
    for (const {uniforms, leastPixels} of [this.fibers, ...this.markers]) {
      uniforms.pixel.value = pixel;
      uniforms.least.value = leastPixels * ratio;
    }
    this.renderer.render(this.stage, this.eye.camera);
    this.container.dataset.state = 'drawn';
  }
}

for (const container of document.querySelectorAll('.fiber-viewer')) {
  if (container.dataset.state) continue;  // of another fragment, whose script has run
  const data = JSON.parse(container.nextElementSibling.textContent);
  try {
    container.viewer = new Viewer(container, data);
  } catch (error) {
    container.dataset.state = 'failed';
    container.innerHTML = '<div class="failure"></div>';
    container.firstChild.textContent =
        `This view needs WebGL, which this browser does not give: ${error.message}`;
  }
}
