// The DDColor server as a real process, with networks that this test writes as ONNX itself (the
// published weights are not here). Exits with 77 (skipped) where npm's packages are missing.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import fs from 'node:fs';
import { createRequire } from 'node:module';
import os from 'node:os';
import path from 'node:path';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { luminance, readPng, resize, srgbFromLab, writePng } from './picture.mjs';

const require = createRequire(import.meta.url);
let grpc, loader;
try {
  grpc = require('@grpc/grpc-js');
  loader = require('@grpc/proto-loader');
  require('onnxruntime-node');
} catch (error) {
  console.log(`SKIPPED: ${error.message.split('\n')[0]} (npm install in deploy/backends/onnx)`);
  process.exit(77);
}

const here = path.dirname(fileURLToPath(import.meta.url));
const script = path.join(here, 'ddcolor.mjs');
const proto = path.join(here, '..', '..', '..', 'proto');
const definition = loader.loadSync('color3d/backend/v1/backend.proto', { includeDirs: [proto] });
const { ColorBackend } = grpc.loadPackageDefinition(definition).color3d.backend.v1;
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'ddcolor-test-'));
const running = [];
after(() => {
  for (const child of running) child.kill('SIGKILL');
  fs.rmSync(folder, { recursive: true });
});

// Protocol buffers by hand: enough of onnx.proto for one 1 x 1 convolution.
const varint = (value) => {
  const bytes = [];
  for (; value > 127; value = Math.floor(value / 128)) bytes.push((value % 128) | 128);
  return Buffer.from([...bytes, value]);
};
const field = (number, value) => {
  if (typeof value === 'number') return Buffer.concat([varint(number * 8), varint(value)]);
  const body = Buffer.from(value);
  return Buffer.concat([varint(number * 8 + 2), varint(body.length), body]);
};
const message = (...fields) => Buffer.concat(fields);
const FLOAT = 1;
const tensor = (name, dims, values) =>
  message(
    ...dims.map((dim) => field(1, dim)),
    field(2, FLOAT),
    field(8, name),
    field(9, Buffer.from(Float32Array.from(values).buffer)),
  );
const value = (name, dims) => {
  const shape = message(
    ...dims.map((dim) => field(1, typeof dim === 'number' ? field(1, dim) : field(2, dim))),
  );
  return message(field(1, name), field(2, field(1, message(field(1, FLOAT), field(2, shape)))));
};
// a and b as `weight` times red, green and blue, plus `bias`.
function network(name, inDims, outDims, weight, bias) {
  const node = message(
    ...['input', 'weight', 'bias'].map((text) => field(1, text)),
    field(2, 'output'),
    field(4, 'Conv'),
  );
  const graph = message(
    field(1, node),
    field(2, 'graph'),
    field(5, tensor('weight', [bias.length, inDims[1], 1, 1], weight)),
    field(5, tensor('bias', [bias.length], bias)),
    field(11, value('input', inDims)),
    field(12, value('output', outDims)),
  );
  const opset = message(field(1, ''), field(2, 13));
  const file = path.join(folder, `${name}.onnx`);
  fs.writeFileSync(file, message(field(1, 8), field(7, graph), field(8, opset)));
  return file;
}

async function start(...flags) {
  const portFile = path.join(folder, `port${running.length}`);
  const args = [script, '--listen', '127.0.0.1:0', '--port-file', portFile, ...flags];
  const child = spawn(process.execPath, args, { stdio: ['ignore', 'ignore', 'inherit'] });
  running.push(child);
  for (let i = 0; i < 600 && !fs.existsSync(portFile); ++i) {
    assert.equal(child.exitCode, null, 'the server ended');
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  const address = fs.readFileSync(portFile, 'utf8').trim();
  return new ColorBackend(address, grpc.credentials.createInsecure());
}
const info = (client) =>
  new Promise((resolve, reject) =>
    client.GetInfo({}, (error, answer) => (error ? reject(error) : resolve(answer))),
  );
const colorize = (client, image) =>
  new Promise((resolve, reject) => {
    const images = [];
    const call = client.Colorize({ image });
    call.on('data', (update) => update.image?.length && images.push(update.image));
    call.on('error', reject);
    call.on('end', () => resolve(images));
  });

// A grey ramp with a dark and a light end.
function ramp(width, height) {
  const data = new Float32Array(width * height);
  for (let i = 0; i < data.length; ++i) data[i] = 0.1 + (0.8 * (i % width)) / (width - 1);
  return { width, height, channels: 1, data };
}
function labOf([r, g, b]) {
  const lin = [r, g, b].map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
  const rows = [
    [0.4124564, 0.3575761, 0.1804375],
    [0.2126729, 0.7151522, 0.072175],
    [0.0193339, 0.119192, 0.9503041],
  ];
  const white = [0.95047, 1, 1.08883];
  const [x, y, z] = rows.map((row, i) => {
    const t = row.reduce((sum, weight, c) => sum + weight * lin[c], 0) / white[i];
    return t > 216 / 24389 ? Math.cbrt(t) : ((24389 / 27) * t + 16) / 116;
  });
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

test("colours as the network says and keeps the photo's luminance", async () => {
  // a = 12 g - 6, b = 10 - 20 g: colours that every luminance of the ramp can have.
  const weight = [4, 4, 4, -8, -8, -4];
  const fixed = network('fixed', [1, 3, 32, 32], [1, 2, 32, 32], weight, [-6, 10]);
  const open = network('open', [1, 3, 'h', 'w'], [1, 2, 'h', 'w'], weight, [-6, 10]);
  const photo = ramp(90, 50);
  for (const [model, ...flags] of [[fixed], [open, '--side', '64']]) {
    const client = await start('--model', model, '--license', 'Apache-2.0', ...flags);
    const told = await info(client);
    assert.equal(told.ready, true);
    assert.equal(told.license, 'Apache-2.0');
    const [png, ...more] = await colorize(client, writePng(photo));
    assert.equal(more.length, 0);
    const answer = readPng(png);
    assert.deepEqual([answer.width, answer.height, answer.channels], [90, 50, 3]);
    for (let x = 4; x < 86; ++x) {
      const i = 25 * 90 + x;
      const [l, a, b] = labOf(answer.data.subarray(3 * i, 3 * i + 3));
      const gray = Math.round(255 * photo.data[i]) / 255;
      assert.ok(Math.abs(l - luminance(gray)) < 0.5, `L ${l} at ${x}`);
      assert.ok(Math.abs(a - (12 * gray - 6)) < 1.2, `a ${a} at ${x}`);
      assert.ok(Math.abs(b - (10 - 20 * gray)) < 1.2, `b ${b} at ${x}`);
    }
  }
});

test('refuses what is no grey PNG, and goes on', async () => {
  const model = network('plain', [1, 3, 16, 16], [1, 2, 16, 16], [0, 0, 0, 0, 0, 0], [5, -40]);
  const client = await start('--model', model);
  const photo = writePng(ramp(40, 30));
  const rgb = writePng({ width: 2, height: 2, channels: 3, data: new Float32Array(12) });
  const damaged = Buffer.from(photo);
  damaged[50] ^= 1;
  for (const [image, words] of [
    [Buffer.from('GIF89a'), /no PNG/],
    [Buffer.alloc(0), /no PNG/],
    [damaged, /damaged/],
    [photo.subarray(0, 60), /breaks off/],
    [rgb, /3 channels/],
  ]) {
    await assert.rejects(colorize(client, image), (error) => {
      assert.equal(error.code, grpc.status.INVALID_ARGUMENT);
      assert.match(error.details, words);
      return true;
    });
  }
  const pictures = await Promise.all([photo, photo, photo].map((image) => colorize(client, image)));
  for (const [png] of pictures) assert.deepEqual(png, pictures[0][0]);
  const call = client.Generate({});
  await assert.rejects(new Promise((_, reject) => call.on('error', reject)), /only colours/);
});

test('a network that cannot be used is refused before anything listens', () => {
  const zeros = [0, 0, 0, 0, 0, 0];
  const square = [1, 3, 16, 16];
  const rgb = network('rgb', square, [1, 3, 16, 16], [...zeros, 0, 0, 0], [0, 0, 0]);
  const gray = network('gray', [1, 1, 16, 16], [1, 2, 16, 16], [0, 0], [0, 0]);
  const nan = network('nan', square, [1, 2, 16, 16], zeros, [NaN, 0]);
  const garbage = path.join(folder, 'garbage.onnx');
  fs.writeFileSync(garbage, 'no network');
  for (const [flags, words] of [
    [[], /--model FILE/],
    [['--model', path.join(folder, 'none.onnx')], /there is no/],
    [['--model', garbage], /no ONNX file/],
    [['--model', rgb], /output is float32 \[1,3,16,16\]/],
    [['--model', gray], /input is float32 \[1,1,16,16\]/],
    [['--model', nan], /NaN/],
    [['--model', nan, '--side', 'x'], /--side/],
    [['--model', nan, '--colour'], /--colour/],
  ]) {
    const options = { encoding: 'utf8', timeout: 60_000 };
    const result = spawnSync(process.execPath, [script, ...flags], options);
    assert.equal(result.status, 1, result.stdout);
    assert.match(result.stderr, words);
    assert.match(result.stderr, /ddcolor\.mjs: .*\n$/);
  }
});

test('pictures are resized without a shift, and colours stay showable', () => {
  const photo = ramp(64, 4);
  const small = resize(photo.data, 64, 4, 16, 2);
  for (let x = 1; x < 15; ++x) {
    assert.ok(Math.abs(small[x] - (photo.data[4 * x + 1] + photo.data[4 * x + 2]) / 2) < 1e-5);
  }
  const large = resize(small, 16, 2, 64, 4);
  for (let x = 6; x < 58; ++x) assert.ok(Math.abs(large[x] - photo.data[x]) < 1e-5);
  const [l, a, b] = labOf(srgbFromLab(50, 150, -20));
  assert.ok(Math.abs(l - 50) < 0.1 && a > 40, `${l} ${a}`);
  assert.ok(Math.abs(b / a + 20 / 150) < 0.02, `${a} ${b}`);
});
