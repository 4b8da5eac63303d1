// --- Panels over the picture ---

const kPanels = `
  <div class="panel about">
    <div class="scenes"></div>
    <h1></h1>
    <p class="counts"></p>
    <p class="drawn"></p>
    <div class="groups"></div>
    <p class="picked" role="status" hidden></p>
  </div>
  <div class="panel show">
    <div><label><input type="checkbox" name="markers"> contacts</label>
      <div class="legend of-markers"><div class="scale"></div>
        <div class="row"><span>touching</span><span class="deepest"></span></div></div></div>
    <div class="of-mesh"><label><input type="checkbox" name="meshmarkers"> contacts with a mesh</label>
      <div class="legend of-meshmarkers"><div class="scale"></div>
        <div class="row"><span>touching</span><span class="deepest"></span></div></div></div>
    <label><input type="checkbox" name="red"> touching segments red</label>
    <label><input type="checkbox" name="touching"> dim all others</label>
    <select name="mesh" class="of-mesh" aria-label="Meshes"><option value="1">solid meshes</option>
      <option value="2">glass meshes</option><option value="0">no meshes</option></select>
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

/// A step is shown by its impacts.
const contactsName = scene => scene.impacts === null ? 'touching pair' : 'impact';

/// What the panel says of a fiber, contact or mesh that was clicked.
function pickedText(picked, frames, meshes) {
  if (picked.triangle !== undefined) return `${meshes.names[picked.mesh]}, triangle ${picked.triangle}`;
  if (picked.fiber !== undefined) {
    const segment = frames.segmentAt(picked.fiber, picked.line, picked.along);
    return `${frames.nameOf(picked.fiber * frames.scene.fiberStep)}, segment ${segment}`;
  }
  const {segments, distances, depths, times} = picked.markers.shown;
  const [fiberA, segmentA, b, ofB] = segments.slice(4 * picked.marker);
  if (frames.scene.impacts !== null) {
    return `${frames.nameOf(fiberA)}, segment ${segmentA} first touches ${frames.nameOf(b)}, ` +
        `segment ${ofB} ` +
        `at time ${short(times[picked.marker])}`;
  }
  const distance = distances[picked.marker];
  const isMesh = picked.markers.kind === kMeshContacts;
  const deep = isMesh ? `${short(-distance)} deep`
      : `${short(-distance)} deep, ${short(100 * depths[picked.marker])} % of the radii's sum`;
  const other = isMesh ? `${meshes.names[b]}, triangle ${ofB}`
      : `${frames.nameOf(b)}, segment ${ofB}`;
  return `${frames.nameOf(fiberA)}, segment ${segmentA} touches ${other}; ` +
      (distance > 0 ? `${short(distance)} apart` : deep);
}
