// --- The address: `#scene=1&frame=20&volumes=spheres&depth=2` opens such a view ---

/// Keys that are numbers, with what holds without them. `frame` is the scene's own then.
const kNumbers = {scene: 0, frame: 0, depth: 2, touching: 0, red: 0, markers: 1, meshmarkers: 1, mesh: 1,
                  bare: 0};

const short = number => String(Number(number.toPrecision(3)));

/// What an address asks for. What it does not know is as if it were not there.
function askedBy(hash) {
  const asked = new URLSearchParams(hash.slice(1));
  const valueOf = (name, form) => form.test(asked.get(name) || '') ? asked.get(name) : '';
  const numbers = {};
  for (const [name, usual] of Object.entries(kNumbers)) {
    numbers[name] = Number(valueOf(name, /^\d+$/) || usual);
  }
  return {
    numbers,
    frameIsGiven: valueOf('frame', /^\d+$/) !== '',
    volumes: valueOf('volumes', /^(boxes|spheres)$/),
    up: valueOf('up', /^[xyz]$/),
    camera: asked.get('camera') || '',
  };
}

/// `azimuth,elevation,zoom` in degrees, or with the target's `,x,y,z` in the file's frame; null if
/// it is neither.
function parsedView(text, middle) {
  const numbers = text.split(',').map(Number);
  const isView = [3, 6].includes(numbers.length) && numbers.every(isFinite) && numbers[2] > 0;
  if (!isView) return null;
  const [azimuth, elevation, zoom, ...target] = numbers;
  const view = {azimuth, elevation, zoom};
  if (target.length) view.target = new THREE.Vector3(...target.map((x, k) => x - middle[k]));
  return view;
}

function addressOf(state, view, scene) {
  const keys = Object.entries({...kNumbers, frame: scene.opened, volumes: '', up: scene.up})
      .filter(([name, usual]) => state[name] !== usual)
      .map(([name]) => `${name}=${state[name]}`);
  if (view) {
    const {azimuth, elevation, zoom, target} = view;
    const numbers = [azimuth.toFixed(1), elevation.toFixed(1), short(zoom)];
    for (const [k, x] of target ? target.toArray().entries() : []) {
      numbers.push(Number((x + scene.middle[k]).toPrecision(6)));
    }
    keys.push(`camera=${numbers.join(',')}`);
  }
  return keys.join('&');
}
