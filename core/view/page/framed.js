// Talks with the page that shows this one in a frame, by messages: what is shown, and where the user
// points. Messages of anybody else, and such that are not as described here, are ignored.
//   in:  {color3d: 'show', shades?: 0|1|2, photo?: name, tone?: [ka, pa, kb, pb], bare?: true}; bare: the page
//        around has the choices of shades and photos; tone: colours become a' = ka a + pa (L + 16),
//        b' = kb b + pb (L + 16) in Lab
//        {color3d: 'recolor', maps: [{photo, width, height, ab: Int8Array}, ...]}: changes of a and b that
//        photos show, pixel after pixel, for the Gaussians that they show; no maps: as it was
//   out: {color3d: 'ready', photos: [name, ...]}; {color3d: 'held', photo: name or null};
//        {color3d: 'picked', photo, x, y}: a click, as a place in a photo that shows the same surface, in
//        shares of its undistorted width and height; {color3d: 'recolored'}: the answer to
//        'recolor'; {color3d: 'drawn'}: that to 'show', when it is on the screen
const color3dFramed = (() => {
'use strict';
const kClickPx = 5, kClickMs = 500;
const kBeam = 0.012;        // radius of a ray that looks for surfaces, per unit of distance
const kSurface = 3;         // Gaussians in the ray that surely are a surface
const kSameDepth = 0.08;    // relative difference of depths of one surface
const kMaxTone = 20;
const kCellsWide = 120;     // of the grid in which a photo looks for what it sees
const kBehind = 0.06;       // relative depth behind the first surface that still belongs to it
const kMaxMaps = 64, kMaxMapPx = 4096;

const minus = (a, b) => a.map((x, i) => x - b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const normal = (a) => { const length = Math.hypot(...a); return a.map((x) => x / length); };
// Rotates by a unit quaternion x y z w; by its inverse with `back`.
const turn = ([x, y, z, w], v, back = false) => {
  const s = back ? -1 : 1;
  const t = [2 * s * (y * v[2] - z * v[1]), 2 * s * (z * v[0] - x * v[2]), 2 * s * (x * v[1] - y * v[0])];
  return [v[0] + w * t[0] + s * (y * t[2] - z * t[1]), v[1] + w * t[1] + s * (z * t[0] - x * t[2]),
          v[2] + w * t[2] + s * (x * t[1] - y * t[0])];
};

// Distance along the ray to the first surface that Gaussians around it form; NaN if there is none.
// `centers`: x y z one after the other; `direction`: of length 1.
const firstSurface = (centers, from, direction) => {
  const [ox, oy, oz] = from, [dx, dy, dz] = direction, hits = [];
  for (let i = 0; i < centers.length; i += 3) {
    const x = centers[i] - ox, y = centers[i + 1] - oy, z = centers[i + 2] - oz;
    const along = x * dx + y * dy + z * dz;
    if (along <= 0) continue;
    const across = x * x + y * y + z * z - along * along;
    if (across < kBeam * kBeam * along * along) hits.push(along);
  }
  if (!hits.length) return NaN;
  hits.sort((a, b) => a - b);
  // Single Gaussians may float before it.
  const groups = hits.map((near, i) => {
    let end = i;
    while (end < hits.length && hits[end] <= near * (1 + kSameDepth / 2)) ++end;
    return end - i;
  });
  const enough = Math.min(kSurface, Math.max(...groups) / 3);
  const first = groups.findIndex((size) => size >= enough);
  return hits[first + (groups[first] >> 1)];
};

// Place of a point in a photo, in shares of it, and its distance; null if it is not in the picture.
const inPhoto = (photo, point) => {
  const [x, y, z] = turn(photo.rotation, minus(point, photo.position), true);
  if (z >= 0) return null;
  const place = { x: photo.center[0] - x / z / (2 * photo.tan * photo.aspect),
                  y: photo.center[1] + y / z / (2 * photo.tan) };
  const edge = 0.01;
  if (!(place.x > edge && place.y > edge && place.x < 1 - edge && place.y < 1 - edge)) return null;
  return { ...place, distance: Math.hypot(x, y, z) };
};

// The photo that shows the surface at `point` most like somebody at `from` sees it; null if none does.
const bestPhoto = (photos, centers, from, point) => {
  const seen = normal(minus(point, from));
  const order = photos.filter((photo) => !photo.held_out)
      .map((photo) => ({ photo, likeness: dot(seen, normal(minus(point, photo.position))) }))
      .sort((a, b) => b.likeness - a.likeness);
  for (const { photo } of order) {
    const place = inPhoto(photo, point);
    if (!place) continue;
    const first = firstSurface(centers, photo.position, normal(minus(point, photo.position)));
    if (Math.abs(first - place.distance) < kSameDepth * place.distance) {
      return { photo: photo.name, x: place.x, y: place.y };
    }
  }
  return null;
};

// What a photo shows, without what is hidden: indices of Gaussians, and their places in it as shares of 65535.
const shownBy = (photo, centers) => {
  const high = Math.max(1, Math.round(kCellsWide / photo.aspect)), count = centers.length / 3;
  const right = turn(photo.rotation, [1, 0, 0]), up = turn(photo.rotation, [0, 1, 0]), back = turn(photo.rotation, [0, 0, 1]);
  const [ox, oy, oz] = photo.position, wide = 2 * photo.tan * photo.aspect, tall = 2 * photo.tan;
  const nearest = new Float32Array(kCellsWide * high).fill(Infinity);
  const depth = new Float32Array(count), at = new Float32Array(2 * count);
  const cellOf = (i) => Math.floor(at[2 * i + 1] * high) * kCellsWide + Math.floor(at[2 * i] * kCellsWide);
  for (let i = 0; i < count; ++i) {
    const x = centers[3 * i] - ox, y = centers[3 * i + 1] - oy, z = centers[3 * i + 2] - oz;
    const far = -(x * back[0] + y * back[1] + z * back[2]);
    if (far <= 0) continue;
    const u = photo.center[0] + (x * right[0] + y * right[1] + z * right[2]) / far / wide;
    const v = photo.center[1] - (x * up[0] + y * up[1] + z * up[2]) / far / tall;
    if (!(u > 0 && v > 0 && u < 1 && v < 1)) continue;
    at[2 * i] = u;
    at[2 * i + 1] = v;
    depth[i] = far;
    const cell = cellOf(i);
    if (far < nearest[cell]) nearest[cell] = far;
  }
  const shown = [];
  for (let i = 0; i < count; ++i) {
    if (depth[i] > 0 && depth[i] <= nearest[cellOf(i)] * (1 + kBehind)) shown.push(i);
  }
  const index = Uint32Array.from(shown), places = new Uint16Array(2 * index.length);
  index.forEach((i, n) => {
    places[2 * n] = 65535 * at[2 * i];
    places[2 * n + 1] = 65535 * at[2 * i + 1];
  });
  return { index, places };
};

// Changes of a and b of each Gaussian, as 128 + change: means over the photos that show it. `known`: what
// photos show, by name, which is added to it.
const changesOf = (photos, centers, maps, known = new Map()) => {
  const count = centers.length / 3;
  const sums = new Float32Array(2 * count), times = new Uint8Array(count);
  for (const { photo: name, width, height, ab } of maps) {
    const photo = photos.find((one) => one.name === name);
    if (!photo) continue;
    if (!known.has(name)) known.set(name, shownBy(photo, centers));
    const { index, places } = known.get(name);
    for (let n = 0; n < index.length; ++n) {
      const pixel = 2 * (((places[2 * n + 1] * height) >> 16) * width + ((places[2 * n] * width) >> 16));
      sums[2 * index[n]] += ab[pixel];
      sums[2 * index[n] + 1] += ab[pixel + 1];
      ++times[index[n]];
    }
  }
  const changes = new Uint8Array(2 * count);
  for (let i = 0; i < changes.length; ++i) changes[i] = 128 + Math.round(sums[i] / Math.max(1, times[i >> 1]));
  return changes;
};

const isMap = ({ photo, width, height, ab } = {}) => typeof photo === 'string' && Number.isInteger(width) &&
    Number.isInteger(height) && width > 0 && height > 0 && width <= kMaxMapPx && height <= kMaxMapPx &&
    ab instanceof Int8Array && ab.length === 2 * width * height;
const isTone = (tone) => Array.isArray(tone) && tone.length === 4 &&
    tone.every((x) => typeof x === 'number' && Math.abs(x) <= kMaxTone);

// hooks: photos; stage, the element; canvas; showShades(mode); showTone(tone); showChanges(bytes or null); goTo(index); held(): the
// photo at whose place the camera stands, with the frame of its picture on the stage, or null; eye():
// position of the camera; ray(x, y): unit direction through a pixel; centers(): in the page's space.
const connect = (hooks) => {
  const tell = (message) => window.parent.postMessage(message, '*');
  const obey = ({ shades, photo, tone, bare }) => {
    if (bare === true) document.body.dataset.bare = '';
    if ([0, 1, 2].includes(shades)) hooks.showShades(shades);
    if (isTone(tone)) hooks.showTone(tone);
    const index = hooks.photos.findIndex(({ name }) => name === photo);
    if (index >= 0) hooks.goTo(index);
    requestAnimationFrame(() => requestAnimationFrame(() => tell({ color3d: 'drawn' })));
  };
  const shown = new Map();
  const recolor = ({ maps }) => {
    if (!Array.isArray(maps) || maps.length > kMaxMaps || !maps.every((map) => map && isMap(map))) return;
    hooks.showChanges(maps.length ? changesOf(hooks.photos, hooks.centers(), maps, shown) : null);
    tell({ color3d: 'recolored' });
  };
  window.addEventListener('message', ({ source, data }) => {
    if (source !== window.parent || data === null || typeof data !== 'object') return;
    if (data.color3d === 'show') obey(data);
    if (data.color3d === 'recolor') recolor(data);
  });

  const pick = (x, y) => {
    const held = hooks.held();
    if (held && !held.photo.held_out) {
      const { left, top, width, height } = held.frame;
      const place = { x: (x - left) / width, y: (y - top) / height };
      if (place.x >= 0 && place.y >= 0 && place.x < 1 && place.y < 1) {
        return { photo: held.photo.name, ...place };
      }
    }
    const from = hooks.eye(), direction = hooks.ray(x, y), centers = hooks.centers();
    const distance = firstSurface(centers, from, direction);
    if (!(distance > 0)) return null;
    return bestPhoto(hooks.photos, centers, from, from.map((c, i) => c + distance * direction[i]));
  };
  // A click lets go of a photo, too: what was held when the button went down counts.
  let down = null;
  hooks.canvas.addEventListener('pointerdown', (event) => {
    down = event.isPrimary && event.button === 0
      ? { x: event.clientX, y: event.clientY, time: performance.now(), place: null } : null;
    if (!down) return;
    const box = hooks.stage.getBoundingClientRect();
    down.place = pick(down.x - box.left, down.y - box.top);
  }, { capture: true, passive: true });
  hooks.canvas.addEventListener('pointerup', (event) => {
    if (!down || performance.now() - down.time > kClickMs) return;
    if (Math.hypot(event.clientX - down.x, event.clientY - down.y) > kClickPx) return;
    if (down.place) tell({ color3d: 'picked', ...down.place });
    down = null;
  }, { capture: true, passive: true });
  tell({ color3d: 'ready', photos: hooks.photos.map(({ name }) => name) });
  return { onHeld: (photo) => tell({ color3d: 'held', photo: photo ? photo.name : null }) };
};

return { connect, firstSurface, inPhoto, bestPhoto, changesOf };
})();
