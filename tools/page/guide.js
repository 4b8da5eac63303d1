// --- The guide filament: a rod that the mouse bends, and whose loads are recorded ---

const kGuidePieces = 50;
const kGrip = 22;  // pixels around the tip
const kMostTries = 100;  // of a move of the mouse
const kMostStates = 10000;  // that a file may have

/// A straight rod, clamped at the origin along z, that neither shears nor stretches, under a force
/// and a torque at its tip. Its twist does not show: with equal stiffness in all directions,
/// d3' = m x d3 / B, and m' = n x d3 with the force n at the tip everywhere (scenes/cosserat_rod.h
/// has the general rod).
class GuideRod {
  constructor({length, stiffness}) {
    Object.assign(this, {length, stiffness});
    this.straighten();
  }

  straighten() {
    this.force = new THREE.Vector3();
    this.torque = new THREE.Vector3();
    this.base = new THREE.Vector3();  // the moment there
    this.points = this.shot(this.force, this.base).points;
  }
  get tip() { return this.points[kGuidePieces]; }

  /// The rod with this moment at its base, by the method of Runge and Kutta; what is at the tip.
  shot(force, base) {
    const h = this.length / kGuidePieces;
    const at = (y, d, step) => y.map((v, i) => v.clone().addScaledVector(d[i], step));
    const slope = ([, d3, m]) => [
      d3, m.clone().cross(d3).divideScalar(this.stiffness), force.clone().cross(d3)];
    let y = [new THREE.Vector3(), new THREE.Vector3(0, 0, 1), base.clone()];
    const points = [y[0]];
    for (let i = 0; i < kGuidePieces; ++i) {
      const a = slope(y), b = slope(at(y, a, h / 2)), c = slope(at(y, b, h / 2)), d = slope(at(y, c, h));
      y = at(at(at(at(y, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
      y[1].normalize();
      points.push(y[0]);
    }
    return {points, moment: y[2]};
  }

  /// The moment at the base for which that at the tip is the torque, by Newton's method from the
  /// one before; null if there is none near by, or the rod is not stable there, and snaps. The
  /// derivative of the moment at the tip has three eigenvalues of 1 without a load. One of them
  /// passes 0 where stability is lost, or two at once where a straight rod is pressed.
  solved(force, torque) {
    const unit = this.stiffness / this.length, base = this.base.clone();
    for (let step = 0; step < 20; ++step) {
      const {points, moment} = this.shot(force, base), rest = torque.clone().sub(moment);
      if (points[kGuidePieces].distanceTo(this.tip) > this.length / 3) return null;
      const eps = 1e-6 * unit;
      const columns = [0, 1, 2].map(k => {
        const other = base.clone();
        other.setComponent(k, other.getComponent(k) + eps);
        return this.shot(force, other).moment.sub(moment).divideScalar(eps);
      });
      const matrix = new THREE.Matrix4().makeBasis(...columns);
      if (rest.length() < 1e-9 * unit) {
        const [a, , , , , b, , , , , c] = matrix.elements;
        return matrix.determinant() > 0 && a + b + c > 1 ? {base, points} : null;
      }
      base.add(rest.applyMatrix4(new THREE.Matrix4().getInverse(matrix)));
    }
    return null;
  }

  /// Brings the load to these, in steps that are halved. Returns false if the rod would snap before;
  /// it then has the last load that it could carry.
  bend(force, torque) {
    for (let part = 1, tries = 0; part > 1e-3 && tries < kMostTries; ++tries) {
      const f = this.force.clone().lerp(force, part), t = this.torque.clone().lerp(torque, part);
      const found = this.solved(f, t);
      if (!found) {
        part /= 2;
        continue;
      }
      Object.assign(this, {force: f, torque: t, ...found});
      if (part === 1) return true;
      part = Math.min(1, 2 * part);
    }
    return false;
  }
}

const kGuidePanel = `
  <div>guide filament: drag its tip; with Shift, turn it</div>
  <div class="row"><button name="record" aria-pressed="false">record</button>
    <button name="save">save</button> <button name="straighten">straighten</button>
    <output></output></div>`;

class Guide {
  constructor(viewer, rod, middle) {
    this.viewer = viewer;
    this.rod = new GuideRod(rod);
    this.states = [];
    this.group = new THREE.Group();
    this.group.position.set(...middle.map(x => -x));
    const material = new THREE.MeshBasicMaterial({color: 0x8fd0ff});
    this.line = new THREE.Mesh(undefined, material);
    this.handle = new THREE.Mesh(new THREE.SphereBufferGeometry(0.012 * rod.length, 16, 12), material);
    this.group.add(this.line, this.handle);
    this.material = material;
    this.uniforms = {onlyTouching: {}};
    this.panel = document.createElement('div');
    this.panel.className = 'panel guide';
    this.panel.innerHTML = kGuidePanel;
    viewer.container.append(this.panel);
    const on = (name, act) => this.panel.querySelector(`[name=${name}]`).addEventListener('click', act);
    on('record', () => this.record(!this.recording));
    on('save', () => this.save());
    on('straighten', () => {
      this.rod.straighten();
      this.note(true);
    });
    this.grip = event => this.take(event);
    viewer.canvas.addEventListener('pointerdown', this.grip, true);
    this.note(true);
  }

  dispose() {
    if (this.release) this.release();
    this.material.dispose();
    this.line.geometry.dispose();
    this.handle.geometry.dispose();
    this.panel.remove();
    this.viewer.canvas.removeEventListener('pointerdown', this.grip, true);
  }

  /// The straight rod, relative to the middle, to be in the picture.
  get extent() {
    const {x, y, z} = this.group.position;
    return new Float32Array([x, y, z, x, y, z + this.rod.length]);
  }

  /// A recording begins at rest.
  record(on) {
    this.recording = on;
    if (on) {
      this.rod.straighten();
      this.states = [];
    }
    this.panel.querySelector('[name=record]').setAttribute('aria-pressed', String(on));
    this.note(true);
  }

  /// Draws the rod, and records its load.
  /// @param reached  whether it is bent as far as the mouse asks
  note(reached) {
    const {points, tip, force, torque} = this.rod;
    const full = this.states.length === kMostStates;
    if (this.recording && !full) this.states.push([...force.toArray(), ...torque.toArray()]);
    this.line.geometry.dispose();
    this.line.geometry = new THREE.TubeBufferGeometry(
        new THREE.CatmullRomCurve3(points), 2 * kGuidePieces, 0.004 * this.rod.length, 6);
    this.handle.position.copy(tip);
    this.panel.querySelector('[name=save]').disabled = this.states.length === 0;
    const trouble = !reached ? '; it would snap' : full ? '; no more are recorded' : '';
    this.panel.querySelector('output').textContent = counted(this.states.length, 'state') + trouble;
    this.viewer.invalidate();
  }

  get text() {
    return '# Force (dyn) and torque (dyn cm) at the tip of the guide filament, in the frame of its base.\n' +
        '# fcl_fibers view paper-dynamic --loads FILE -o OUT.html replays them on the assembly.\n' +
        this.states.map(state => state.map(x => Number(x.toPrecision(6))).join(' ') + '\n').join('');
  }

  save() {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([this.text], {type: 'text/plain'}));
    link.download = 'recorded_loads.txt';
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);  // the download has begun by then
  }

  // --- The mouse ---

  take(event) {
    const {canvas, eye} = this.viewer, {left, top, width, height} = canvas.getBoundingClientRect();
    const seen = this.rod.tip.clone().add(this.group.position).project(eye.camera);
    const x = left + (seen.x + 1) / 2 * width, y = top + (1 - seen.y) / 2 * height;
    if (event.button !== 0 || Math.hypot(event.clientX - x, event.clientY - y) > kGrip) return;
    event.stopImmediatePropagation();
    eye.controls.enabled = false;
    let last = [event.clientX, event.clientY];
    const move = moved => {
      if (moved.pointerId !== event.pointerId) return;
      this.drag(moved.clientX - last[0], moved.clientY - last[1], moved.shiftKey);
      last = [moved.clientX, moved.clientY];
    };
    const release = lifted => {
      if (lifted && lifted.pointerId !== event.pointerId) return;
      this.release = null;
      eye.controls.enabled = true;
      window.removeEventListener('pointermove', move);
      for (const end of ['pointerup', 'pointercancel']) window.removeEventListener(end, release);
    };
    this.release = release;
    window.addEventListener('pointermove', move);
    for (const end of ['pointerup', 'pointercancel']) window.addEventListener(end, release);
  }

  /// By pixels: changes the force as a short cantilever would need it, or the torque.
  drag(dx, dy, turns) {
    const {canvas, eye} = this.viewer, {length, stiffness} = this.rod;
    const axis = (x, y, z) => new THREE.Vector3(x, y, z).transformDirection(eye.camera.matrixWorld);
    const tip = this.rod.tip.clone().add(this.group.position);
    const depth = -tip.applyMatrix4(eye.camera.matrixWorldInverse).z;
    const pixel = 2 * eye.tangent * depth / canvas.clientHeight;
    const by = axis(1, 0, 0).multiplyScalar(dx * pixel).addScaledVector(axis(0, 1, 0), -dy * pixel);
    const force = this.rod.force.clone(), torque = this.rod.torque.clone();
    if (turns) {
      const along = this.rod.tip.clone().sub(this.rod.points[kGuidePieces - 1]).normalize();
      torque.addScaledVector(along.cross(by), 2 * stiffness / (length * length));
    } else {
      force.addScaledVector(by, 3 * stiffness / (length * length * length));
    }
    this.note(this.rod.bend(force, torque));
  }
}
