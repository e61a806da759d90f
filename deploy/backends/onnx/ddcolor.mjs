#!/usr/bin/env node
// A model server for color3d that colours photos with DDColor (or any network of its kind) as ONNX:
// grey RGB of N x N px in, a and b of Lab out. The README in the folder above says how to run it.
//   node ddcolor.mjs --model ddcolor.onnx [--listen 127.0.0.1:50663]
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

import { luminance, readPng, resize, srgbFromLab, writePng } from './picture.mjs';

const MAX_PIXELS = 50_000_000;
const MAX_MESSAGE_BYTES = 256 << 20;
const MAX_AB = 200;
// Sides of the network's input where the file leaves them open.
const DEFAULT_SIDE_PX = 512;

// One line on stderr and exit code 1: what is wrong with the command, the file or the installation.
class UsageError extends Error {}

function packages() {
  // require() rather than import: it also looks into NODE_PATH.
  const require = createRequire(import.meta.url);
  try {
    return {
      grpc: require('@grpc/grpc-js'),
      loader: require('@grpc/proto-loader'),
      ort: require('onnxruntime-node'),
    };
  } catch (error) {
    if (error.code !== 'MODULE_NOT_FOUND') throw error;
    const missing = error.message.split('\n')[0];
    throw new UsageError(`${missing}; run npm install in deploy/backends/onnx`);
  }
}

// A network that is checked to be of DDColor's kind, and what it is fed.
export class DdColor {
  static async load(ort, file, side, threads) {
    if (!fs.existsSync(file)) throw new UsageError(`there is no ${file}`);
    let session;
    try {
      session = await ort.InferenceSession.create(file, { intraOpNumThreads: threads });
    } catch (error) {
      throw new UsageError(`${file} is no ONNX file that can be run: ${oneLine(error)}`);
    }
    const [input] = session.inputMetadata;
    const [output] = session.outputMetadata;
    if (session.inputNames.length !== 1) {
      throw new UsageError(`${file} takes ${session.inputNames.length} inputs; DDColor takes one`);
    }
    const expect = (what, value, channels) => {
      const { type, shape } = value;
      const fits = shape.length === 4 && (typeof shape[1] !== 'number' || shape[1] === channels);
      if (type === 'float32' && fits) return;
      throw new UsageError(
        `${file}: its ${what} is ${type} [${shape}]; DDColor's is float32 [1, ${channels}, N, N]`,
      );
    };
    expect('input', input, 3);
    expect('output', output, 2);
    const sideOf = (value) => (typeof value === 'number' && value > 0 ? value : side);
    const model = new DdColor();
    Object.assign(model, { ort, session });
    model.height = sideOf(input.shape[2]);
    model.width = sideOf(input.shape[3]);
    // Finds out now, not at the first photo, that the network cannot be run.
    try {
      await model.ab(new Float32Array(model.width * model.height));
    } catch (error) {
      throw new UsageError(`${file} cannot be run: ${oneLine(error)}`);
    }
    return model;
  }

  // a and b, planes of {width, height}, for greys of the network's own size.
  async ab(gray) {
    const fed = new Float32Array(3 * gray.length);
    for (let c = 0; c < 3; ++c) fed.set(gray, c * gray.length);
    const shape = [1, 3, this.height, this.width];
    const feeds = { [this.session.inputNames[0]]: new this.ort.Tensor('float32', fed, shape) };
    const { dims, data } = (await this.session.run(feeds))[this.session.outputNames[0]];
    if (dims.length !== 4 || dims[0] !== 1 || dims[1] !== 2) {
      throw new Error(`the network answered with [${dims}]; [1, 2, N, N] was due`);
    }
    const [, , height, width] = dims;
    for (const value of data) {
      if (!Number.isFinite(value)) throw new Error('the network answered with NaN or infinity');
    }
    return { width, height, a: data.subarray(0, width * height), b: data.subarray(width * height) };
  }

  // PNG in colour of a grey PNG, with its luminance. Throws RangeError for what is no such PNG.
  async colorize(png) {
    const { width, height, channels, data } = readPng(png, MAX_PIXELS);
    if (channels !== 1) throw new RangeError(`a PNG of ${channels} channels; a grey one is due`);
    const answer = await this.ab(resize(data, width, height, this.width, this.height));
    const grow = (plane) => resize(plane, answer.width, answer.height, width, height);
    const a = grow(answer.a);
    const b = grow(answer.b);
    const rgb = new Float32Array(3 * data.length);
    const bound = (value) => Math.min(MAX_AB, Math.max(-MAX_AB, value));
    for (let i = 0; i < data.length; ++i) {
      rgb.set(srgbFromLab(luminance(data[i]), bound(a[i]), bound(b[i])), 3 * i);
    }
    return writePng({ width, height, channels: 3, data: rgb });
  }
}

const oneLine = (error) => String(error.message ?? error).replace(/\s+/g, ' ').slice(0, 300);

function service(grpc, model, options) {
  // One picture at a time: the network takes all cores.
  let last = Promise.resolve();
  return {
    GetInfo(call, reply) {
      reply(null, {
        name: options.name,
        version: options['model-version'],
        license: options.license,
        capabilities: ['CAPABILITY_AUTOMATIC'],
        maxPixels: MAX_PIXELS,
        deterministic: true,
        ready: true,
      });
    },
    Colorize(call) {
      last = last.then(async () => {
        if (call.cancelled) return;
        try {
          call.write({ progress: 0 });
          call.write({ image: await model.colorize(call.request.image) });
          call.end();
        } catch (error) {
          const theirs = error instanceof RangeError;
          const code = theirs ? grpc.status.INVALID_ARGUMENT : grpc.status.INTERNAL;
          const details = theirs ? `the photo is ${error.message}` : oneLine(error);
          call.emit('error', { code, details });
        }
      });
    },
    Generate(call) {
      const details = 'this server only colours';
      call.emit('error', { code: grpc.status.UNIMPLEMENTED, details });
    },
  };
}

function readOptions() {
  const text = (otherwise) => ({ type: 'string', default: otherwise });
  let values;
  try {
    ({ values } = parseArgs({
      options: {
        model: { type: 'string' },
        listen: text('127.0.0.1:50663'),
        'port-file': { type: 'string' },
        side: text(String(DEFAULT_SIDE_PX)),
        threads: text('0'),
        name: text('DDColor as ONNX'),
        'model-version': text(''),
        license: text(''),
      },
    }));
  } catch (error) {
    throw new UsageError(oneLine(error));
  }
  if (!values.model) throw new UsageError('give the network with --model FILE.onnx');
  const number = (name, least, most) => {
    const value = Number(values[name]);
    if (Number.isInteger(value) && value >= least && value <= most) return value;
    throw new UsageError(`--${name} must be a whole number from ${least} to ${most}`);
  };
  return { ...values, side: number('side', 32, 4096), threads: number('threads', 0, 256) };
}

async function main() {
  const options = readOptions();
  const { grpc, loader, ort } = packages();
  const here = path.dirname(fileURLToPath(import.meta.url));
  const root = process.env.COLOR3D_PROTO ?? path.join(here, '..', '..', '..', 'proto');
  const file = 'color3d/backend/v1/backend.proto';
  if (!fs.existsSync(path.join(root, file))) {
    const remedy = "set COLOR3D_PROTO to color3d's folder proto";
    throw new UsageError(`there is no ${file} in ${root}; ${remedy}`);
  }
  const loading = { includeDirs: [root], longs: Number, enums: String };
  const { color3d } = grpc.loadPackageDefinition(loader.loadSync(file, loading));
  const model = await DdColor.load(ort, options.model, options.side, options.threads);
  const server = new grpc.Server({
    'grpc.max_receive_message_length': MAX_MESSAGE_BYTES,
    'grpc.max_send_message_length': MAX_MESSAGE_BYTES,
    'grpc.so_reuseport': 0,
  });
  server.addService(color3d.backend.v1.ColorBackend.service, service(grpc, model, options));
  const port = await new Promise((resolve, reject) => {
    const failed = `cannot listen on ${options.listen}; choose another with --listen`;
    server.bindAsync(options.listen, grpc.ServerCredentials.createInsecure(), (error, bound) =>
      error ? reject(new UsageError(failed)) : resolve(bound),
    );
  });
  const unix = options.listen.startsWith('unix:');
  const address = unix ? options.listen : options.listen.replace(/:\d+$/, `:${port}`);
  if (options['port-file']) {
    fs.writeFileSync(`${options['port-file']}.new`, `${address}\n`);
    fs.renameSync(`${options['port-file']}.new`, options['port-file']);
  }
  console.log(`ddcolor.mjs listens on ${address}; ${model.width} x ${model.height} px`);
}

if (process.argv[1] && fs.realpathSync(process.argv[1]) === fileURLToPath(import.meta.url)) {
  main().catch((error) => {
    console.error(error instanceof UsageError ? `ddcolor.mjs: ${error.message}` : error);
    process.exit(1);
  });
}
