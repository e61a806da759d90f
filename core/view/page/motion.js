// Gaussians that move: reads the motion beside the scene (core/splat/export/motion/FORMAT.md), moves
// the Gaussians in the viewer's copy pass, and tells its sorter where they are.
const color3dMotion = (() => {
'use strict';
const kHeader = 72;
const kWindowEnd = 4.3;  // widths of a window from its center to where nothing is seen
const kRGBA32U = 49, kR32U = 37;  // the viewer's names of pixel formats

// ---- the file ---------------------------------------------------------------------------------
const read = (buffer) => {
  const view = new DataView(buffer), bytes = new Uint8Array(buffer);
  const fail = (why) => { throw new Error(`The motion of this scene cannot be read: ${why}`); };
  if (bytes.length < kHeader || String.fromCharCode(...bytes.subarray(0, 8)) !== 'C3DMOVES') {
    fail('it does not begin as such a file');
  }
  if (view.getUint32(8, true) !== 1) fail(`it has version ${view.getUint32(8, true)}, and 1 is known`);
  const total = view.getUint32(12, true), count = view.getUint32(16, true);
  const maskBytes = total + 7 >>> 3;
  if (bytes.length !== kHeader + maskBytes + 20 * count) fail(`it has ${bytes.length} bytes`);
  const [centerLow, centerHigh, widthLow, widthHigh, path, bend, turn] =
    [40, 44, 48, 52, 56, 60, 64].map((at) => view.getFloat32(at, true));
  const index = new Uint32Array(count);
  let found = 0;
  for (let i = 0; i < total; ++i) {
    if (bytes[kHeader + (i >> 3)] >> (i & 7) & 1) index[found++] = i;
  }
  if (found !== count) fail(`it marks ${found} Gaussians, not ${count}`);
  let at = kHeader + maskBytes;
  const words = () => {
    const out = new Uint16Array(count);
    for (let i = 0; i < count; ++i) out[i] = bytes[at + i] | bytes[at + count + i] << 8;
    at += 2 * count;
    return out;
  };
  const center = words(), width = words();
  const paths = [words(), words(), words()], bends = [words(), words(), words()];
  const turns = [0, 1, 2, 3].map((k) => bytes.subarray(at + k * count, at + (k + 1) * count));
  return { begin: view.getFloat64(24, true), end: view.getFloat64(32, true), total, count, index,
           center, width, paths, bends, turns, most: [path, bend, turn],
           window: [centerLow, centerHigh - centerLow, widthLow, widthHigh - widthLow] };
};

// ---- the shader -------------------------------------------------------------------------------
// motionPath: path xyz, bend xyz, center, width; 16 bits each; a width of 0 is a Gaussian that
// stands. motionTurn: spin w x y z, 8 bits each.
const streams = [{ name: 'motionPath', format: kRGBA32U }, { name: 'motionTurn', format: kR32U }];
const glsl = {
  declare: `
uniform float uTime;
uniform vec4 uWindow;
uniform vec3 uMost;
vec3 fromSquare(vec3 s, float most) { return most * s * abs(s); }
// Time from the center over the reach, and the share of the opacity.
vec2 motionNow(uint code) {
  float center = uWindow.x + uWindow.y * float(code & 0xffffu) / 65535.0;
  float width = exp(uWindow.z + uWindow.w * (float(code >> 16u) - 1.0) / 65534.0);
  float tau = uTime - center;
  float scaled = tau / width;
  float share = exp(-0.5 * scaled * scaled);
  return vec2(clamp(tau / min(${kWindowEnd} * width, 1.0 + abs(center)), -1.0, 1.0), share);
}
vec4 turnedBy(vec4 a, vec4 b) {
  return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}
`,
  center: `
  uvec4 code = loadMotionPath();
  if ((code.w >> 16u) == 0u) return;
  float u = motionNow(code.w).x;
  vec2 a = unpackSnorm2x16(code.x), b = unpackSnorm2x16(code.y), c = unpackSnorm2x16(code.z);
  vec3 moved = u * (fromSquare(vec3(a, b.x), uMost.x) + u * fromSquare(vec3(b.y, c), uMost.y));
  center += (matrix_model * vec4(moved, 0.0)).xyz;
`,
  rotation: `
  uint code = loadMotionPath().w;
  if ((code >> 16u) == 0u) return;
  uint spin = loadMotionTurn().r;
  vec4 s = vec4(ivec4(int(spin << 16u), int(spin << 8u), int(spin), int(spin << 24u)) >> 24) / 127.0;
  vec4 turn = motionNow(code).x * uMost.z * s * abs(s) + vec4(0.0, 0.0, 0.0, 1.0);
  rotation = normalize(turnedBy(rotation, turn));
  if (rotation.w < 0.0) rotation = -rotation;
`,
  color: `
  uint code = loadMotionPath().w;
  if ((code >> 16u) != 0u) {
    color.a *= motionNow(code).y;
    if (color.a < 1e-4) color.a = 0.0;
  }
`,
};
const wgsl = {
  declare: `
uniform uTime: f32;
uniform uWindow: vec4f;
uniform uMost: vec3f;
fn fromSquare(s: vec3f, most: f32) -> vec3f { return most * s * abs(s); }
fn motionNow(code: u32) -> vec2f {
  let center = uniform.uWindow.x + uniform.uWindow.y * f32(code & 0xffffu) / 65535.0;
  let width = exp(uniform.uWindow.z + uniform.uWindow.w * (f32(code >> 16u) - 1.0) / 65534.0);
  let tau = uniform.uTime - center;
  let scaled = tau / width;
  let share = exp(-0.5 * scaled * scaled);
  return vec2f(clamp(tau / min(${kWindowEnd} * width, 1.0 + abs(center)), -1.0, 1.0), share);
}
fn turnedBy(a: vec4f, b: vec4f) -> vec4f {
  return vec4f(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}
`,
  center: `
  let code = loadMotionPath();
  if ((code.w >> 16u) == 0u) { return; }
  let u = motionNow(code.w).x;
  let a = unpack2x16snorm(code.x);
  let b = unpack2x16snorm(code.y);
  let c = unpack2x16snorm(code.z);
  let moved = u * (fromSquare(vec3f(a, b.x), uniform.uMost.x) + u * fromSquare(vec3f(b.y, c), uniform.uMost.y));
  *center = *center + (uniform.matrix_model * vec4f(moved, 0.0)).xyz;
`,
  rotation: `
  let code = loadMotionPath().w;
  if ((code >> 16u) == 0u) { return; }
  let spin = bitcast<i32>(loadMotionTurn().r);
  let s = vec4f((vec4i(spin) << vec4u(16u, 8u, 0u, 24u)) >> vec4u(24u)) / 127.0;
  let turn = motionNow(code).x * uniform.uMost.z * s * abs(s) + vec4f(0.0, 0.0, 0.0, 1.0);
  let turned = normalize(turnedBy(*rotation, turn));
  *rotation = select(turned, -turned, turned.w < 0.0);
`,
  color: `
  let code = loadMotionPath().w;
  if ((code >> 16u) != 0u) {
    var seen = (*color).a * motionNow(code).y;
    if (seen < 1e-4) { seen = 0.0; }
    *color = vec4f((*color).rgb, seen);
  }
`,
};

// Fills the two textures of the viewer's resource; its streams must have been added.
const fill = (motion, resource) => {
  const path = resource.getTexture('motionPath'), turn = resource.getTexture('motionTurn');
  const paths = path.lock(), turns = turn.lock();
  paths.fill(0);
  turns.fill(0);
  const [px, py, pz] = motion.paths, [bx, by, bz] = motion.bends, [tw, tx, ty, tz] = motion.turns;
  for (let j = 0; j < motion.count; ++j) {
    const i = motion.index[j];
    paths[4 * i] = px[j] | py[j] << 16;
    paths[4 * i + 1] = pz[j] | bx[j] << 16;
    paths[4 * i + 2] = by[j] | bz[j] << 16;
    paths[4 * i + 3] = motion.center[j] | motion.width[j] << 16;
    turns[i] = tw[j] | tx[j] << 8 | ty[j] << 16 | tz[j] << 24;
  }
  path.unlock();
  turn.unlock();
};

// ---- where Gaussians are, for the sorter ------------------------------------------------------
// `centers`: 3 for each Gaussian of the file, the viewer's; moveTo changes them.
const followed = (motion, centers) => {
  const { count, index } = motion;
  const [low, range, widthLow, widthRange] = motion.window;
  const base = new Float32Array(3 * count);
  const path = new Float32Array(3 * count), bend = new Float32Array(3 * count);
  const center = new Float32Array(count), reach = new Float32Array(count);
  const value = (code, most) => {
    const s = Math.max(-1, (code << 16 >> 16) / 32767);
    return most * s * Math.abs(s);
  };
  for (let j = 0; j < count; ++j) {
    for (let k = 0; k < 3; ++k) {
      base[3 * j + k] = centers[3 * index[j] + k];
      path[3 * j + k] = value(motion.paths[k][j], motion.most[0]);
      bend[3 * j + k] = value(motion.bends[k][j], motion.most[1]);
    }
    center[j] = low + range * motion.center[j] / 65535;
    const width = Math.exp(widthLow + widthRange * (motion.width[j] - 1) / 65534);
    reach[j] = Math.min(kWindowEnd * width, 1 + Math.abs(center[j]));
  }
  // Those that are not seen stay where they were.
  const moveTo = (t) => {
    for (let j = 0; j < count; ++j) {
      const u = (t - center[j]) / reach[j];
      if (u < -1 || u > 1) continue;
      const to = 3 * index[j];
      for (let k = 0, from = 3 * j; k < 3; ++k, ++from) {
        centers[to + k] = base[from] + u * (path[from] + u * bend[from]);
      }
    }
  };
  // The corners of the box around all places where they are seen.
  const box = () => {
    const least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
    for (let j = 0; j < count; ++j) {
      const from = Math.max(-1, (-1 - center[j]) / reach[j]);
      const to = Math.min(1, (1 - center[j]) / reach[j]);
      for (let step = 0; step <= 4; ++step) {
        const u = from + (to - from) * step / 4;
        for (let k = 0; k < 3; ++k) {
          const x = base[3 * j + k] + u * (path[3 * j + k] + u * bend[3 * j + k]);
          if (x < least[k]) least[k] = x;
          if (x > most[k]) most[k] = x;
        }
      }
    }
    return { least, most };
  };
  return { moveTo, box };
};

return { read, streams, glsl, wgsl, fill, followed };
})();
