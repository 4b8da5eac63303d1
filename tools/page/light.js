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
