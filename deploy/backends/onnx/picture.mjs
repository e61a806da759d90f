// Pictures for model servers in Node, without packages: PNG, CIE Lab (D65), resizing.
import zlib from 'node:zlib';

const SIGNATURE = Buffer.from('89504e470d0a1a0a', 'hex');
const CHANNELS = { 0: 1, 2: 3, 4: 2, 6: 4 };

// CRC-32 as PNG has it (zlib.crc32 is younger than Node 18).
const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; ++k) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n >>> 0;
});
function crc32(data) {
  let crc = 0xffffffff;
  for (const byte of data) crc = CRC_TABLE[(crc ^ byte) & 255] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

function unfilter(kind, row, above, step) {
  for (let i = 0; i < row.length; ++i) {
    const left = i >= step ? row[i - step] : 0;
    const up = above[i];
    if (kind === 1) row[i] += left;
    else if (kind === 2) row[i] += up;
    else if (kind === 3) row[i] += (left + up) >> 1;
    else {
      const corner = i >= step ? above[i - step] : 0;
      const toLeft = Math.abs(up - corner);
      const toUp = Math.abs(left - corner);
      const toCorner = Math.abs(left + up - 2 * corner);
      row[i] += toLeft <= toUp && toLeft <= toCorner ? left : toUp <= toCorner ? up : corner;
    }
  }
}

// {width, height, channels, data}: Float32Array of 0..1, channels interleaved. PNG of 8 or 16 bits
// without interlacing; throws RangeError for anything else.
export function readPng(bytes, maxPixels = 50_000_000) {
  if (bytes.length < 33 || !bytes.subarray(0, 8).equals(SIGNATURE)) throw new RangeError('no PNG');
  const width = bytes.readUInt32BE(16);
  const height = bytes.readUInt32BE(20);
  const [depth, color, , , interlaced] = bytes.subarray(24, 29);
  const channels = CHANNELS[color];
  if (width < 1 || height < 1 || width * height > maxPixels) {
    throw new RangeError(`a PNG of ${width} x ${height} px; at most ${maxPixels} pixels`);
  }
  if ((depth !== 8 && depth !== 16) || !channels || interlaced) {
    throw new RangeError('a PNG with a palette, few bits or interlacing');
  }
  const parts = [];
  let ended = false;
  for (let at = 8; !ended; ) {
    if (at + 12 > bytes.length) throw new RangeError('a PNG that breaks off');
    const length = bytes.readUInt32BE(at);
    if (at + 12 + length > bytes.length) throw new RangeError('a PNG that breaks off');
    const body = bytes.subarray(at + 4, at + 8 + length);
    if (crc32(body) !== bytes.readUInt32BE(at + 8 + length)) throw new RangeError('a damaged PNG');
    const kind = body.toString('latin1', 0, 4);
    if (kind === 'IDAT') parts.push(body.subarray(4));
    ended = kind === 'IEND';
    at += 12 + length;
  }
  const step = (channels * depth) / 8;
  const stride = 1 + width * step;
  let raw;
  try {
    raw = zlib.inflateSync(Buffer.concat(parts), { maxOutputLength: stride * height });
  } catch {
    throw new RangeError('a damaged PNG');
  }
  if (raw.length !== stride * height) throw new RangeError('a PNG that breaks off');
  const data = new Float32Array(width * height * channels);
  const count = width * channels;
  let above = Buffer.alloc(stride - 1);
  for (let y = 0; y < height; ++y) {
    const kind = raw[y * stride];
    const row = raw.subarray(y * stride + 1, (y + 1) * stride);
    if (kind > 4) throw new RangeError('a damaged PNG');
    if (kind > 0) unfilter(kind, row, above, step);
    for (let i = 0; i < count; ++i) {
      data[y * count + i] = depth === 8 ? row[i] / 255 : row.readUInt16BE(2 * i) / 65535;
    }
    above = row;
  }
  return { width, height, channels, data };
}

// PNG, 8 bits, of one or three channels.
export function writePng({ width, height, channels, data }) {
  const count = width * channels;
  const raw = Buffer.alloc((count + 1) * height);
  for (let y = 0; y < height; ++y) {
    for (let i = 0; i < count; ++i) {
      const value = Math.min(1, Math.max(0, data[y * count + i]));
      raw[y * (count + 1) + 1 + i] = Math.round(255 * value);
    }
  }
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, channels === 3 ? 2 : 0], 8);
  const chunk = (kind, part) => {
    const body = Buffer.concat([Buffer.from(kind, 'latin1'), part]);
    const framed = Buffer.alloc(body.length + 8);
    framed.writeUInt32BE(part.length, 0);
    body.copy(framed, 4);
    framed.writeUInt32BE(crc32(body), body.length + 4);
    return framed;
  };
  const end = chunk('IEND', Buffer.alloc(0));
  const body = chunk('IDAT', zlib.deflateSync(raw));
  return Buffer.concat([SIGNATURE, chunk('IHDR', header), body, end]);
}

// One plane of another size: means where it shrinks, linear between pixel centres where it grows.
export function resize(plane, width, height, newWidth, newHeight) {
  const across = weights(width, newWidth);
  const down = weights(height, newHeight);
  const wide = new Float32Array(newWidth * height);
  for (let y = 0; y < height; ++y) {
    across.forEach((taps, x) => {
      let sum = 0;
      for (const [from, weight] of taps) sum += weight * plane[y * width + from];
      wide[y * newWidth + x] = sum;
    });
  }
  const result = new Float32Array(newWidth * newHeight);
  down.forEach((taps, y) => {
    for (const [from, weight] of taps) {
      for (let x = 0; x < newWidth; ++x) {
        result[y * newWidth + x] += weight * wide[from * newWidth + x];
      }
    }
  });
  return result;
}

// For each new place the old ones that it comes from, with weights that sum to 1.
function weights(side, newSide) {
  const scale = side / newSide;
  const reach = Math.max(1, scale);
  return Array.from({ length: newSide }, (_, i) => {
    const centre = (i + 0.5) * scale - 0.5;
    const taps = [];
    let sum = 0;
    for (let j = Math.ceil(centre - reach); j <= Math.floor(centre + reach); ++j) {
      const weight = 1 - Math.abs(j - centre) / reach;
      if (weight <= 0) continue;
      taps.push([Math.min(side - 1, Math.max(0, j)), weight]);
      sum += weight;
    }
    return taps.map(([from, weight]) => [from, weight / sum]);
  });
}

const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const encoded = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const curve = (t) => (t > 216 / 24389 ? Math.cbrt(t) : ((24389 / 27) * t + 16) / 116);
const uncurve = (f) => (f > 6 / 29 ? f ** 3 : (116 * f - 16) / (24389 / 27));

// L, 0..100, of a grey of 0..1.
export const luminance = (gray) => 116 * curve(linear(gray)) - 16;

function linearRgb(l, a, b) {
  const fy = (l + 16) / 116;
  const x = 0.95047 * uncurve(fy + a / 500);
  const y = uncurve(fy);
  const z = 1.08883 * uncurve(fy - b / 200);
  return [
    3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
    -0.969266 * x + 1.8760108 * y + 0.041556 * z,
    0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
  ];
}
const shown = (rgb) => rgb.every((v) => v >= -1e-4 && v <= 1 + 1e-4);

// sRGB of 0..1 with exactly this luminance: where no such colour can be shown, a paler one.
export function srgbFromLab(l, a, b) {
  let rgb = linearRgb(l, a, b);
  if (!shown(rgb)) {
    let low = 0;
    let high = 1;
    for (let i = 0; i < 10; ++i) {
      const middle = (low + high) / 2;
      if (shown(linearRgb(l, middle * a, middle * b))) low = middle;
      else high = middle;
    }
    rgb = linearRgb(l, low * a, low * b);
  }
  return rgb.map((v) => encoded(Math.min(1, Math.max(0, v))));
}
