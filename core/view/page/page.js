// Drives the viewer of the page: colours, photos, comparison. All that it needs is in the page.
(() => {
'use strict';
const $ = (id) => document.getElementById(id);
const facts = JSON.parse($('facts').textContent);
const photos = facts.photos;
const pictureOf = (photo) => photo.jpeg ? 'data:image/jpeg;base64,' + photo.jpeg : '';
const say = (text) => { $('note').textContent = text; };
const press = (button, on) => button.setAttribute('aria-pressed', String(on));

const shades = {
  uSeen: ['#6fb7b0', 'seen in a key view'],
  uInferred: ['#e0b25f', 'inferred from it'],
  uGuessed: ['#b873a0', 'guessed'],
};
const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

const bytesOf = (base64) => fetch('data:application/octet-stream;base64,' + base64);
const unpacked = async (base64) =>
  new Response((await bytesOf(base64)).body.pipeThrough(new DecompressionStream('gzip')));

// The viewer's module, run from its text: pages opened from a disk may not import files.
const loadProgram = async () => {
  const code = await (await unpacked($('program').textContent)).text();
  const script = document.createElement('script');
  script.type = 'module';
  const ready = new Promise((resolve) => { window.color3dProgram = resolve; });
  script.textContent = code + '\nwindow.color3dProgram(createViewer);\n';
  document.head.appendChild(script);
  return ready;
};

// ---- cameras ----------------------------------------------------------------------------------
const stage = $('stage');
// Where the whole picture of `photo` fits on the stage, px, with the camera's axis in the middle.
const frameOf = (photo) => {
  const w = stage.clientWidth, h = stage.clientHeight;
  const reachX = Math.max(photo.center[0], 1 - photo.center[0]);
  const reachY = Math.max(photo.center[1], 1 - photo.center[1]);
  const height = Math.min(h / (2 * reachY), w / (2 * reachX * photo.aspect));
  const width = height * photo.aspect;
  return { width, height, left: w / 2 - photo.center[0] * width, top: h / 2 - photo.center[1] * height };
};
// Vertical field of view of the whole stage then, degrees.
const fovOf = (photo) => {
  const tan = photo.tan * stage.clientHeight / frameOf(photo).height;
  return 2 * Math.atan(tan) * 180 / Math.PI;
};
// The viewer's fields of view belong to the stage's longer side.
const longFov = (degrees) => {
  const w = stage.clientWidth, h = stage.clientHeight;
  if (w <= h) return degrees;
  return 2 * Math.atan(Math.tan(degrees * Math.PI / 360) * w / h) * 180 / Math.PI;
};

// The way around the target for `Turn`, as movies go it.
const turnTrack = () => {
  const fov = longFov(fovOf(photos[facts.key]));
  const target = [0, 0, 0];
  return { name: 'turn', duration: facts.turn.length, frameRate: 30, loopMode: 'repeat',
           interpolation: 'spline', smoothness: 1,
           keyframes: { times: facts.turn.map((_, i) => i * 30),
                        values: { position: facts.turn.flat(),
                                  target: facts.turn.flatMap(() => target),
                                  fov: facts.turn.map(() => fov) } } };
};

const off = { enabled: false };
const settingsOf = () => ({
  version: 2, tonemapping: 'none', highPrecisionRendering: false,
  background: { color: [0, 0, 0] },
  postEffectSettings: {
    sharpness: { ...off, amount: 0 }, bloom: { ...off, intensity: 0.1, blurLevel: 2 },
    grading: { ...off, brightness: 1, contrast: 1, saturation: 1, tint: [1, 1, 1] },
    vignette: { ...off, intensity: 0.5, inner: 0.3, outer: 0.75, curvature: 1 },
    fringing: { ...off, intensity: 0.5 },
  },
  animTracks: [turnTrack()], startMode: 'animTrack',
  cameras: [{ initial: cameraOf(photos[facts.key]) }],
  annotations: photos.map((photo) => ({
    position: photo.target, title: photo.name, text: '', camera: { initial: cameraOf(photo) } })),
});
const cameraOf = (photo) =>
  ({ position: photo.position, target: photo.target, fov: longFov(fovOf(photo)) });

// ---- the page ---------------------------------------------------------------------------------
let viewer = null, splats = null;
let player = null;  // of a scene that moves
let frame = null;  // connection with the page that shows this one, if one does
let held = null;  // {photo, from, since}: the camera stands where this photo was taken

const showShades = (mode) => {
  for (const button of document.querySelectorAll('[data-shades]')) {
    press(button, Number(button.dataset.shades) === mode);
  }
  $('legend').hidden = mode !== 2;
  splats.setParameter('uShades', mode);
  viewer.app.renderNextFrame = true;
};

const layOut = () => {
  const comparing = $('compare').getAttribute('aria-pressed') === 'true' && held && held.photo.jpeg;
  for (const id of ['photo', 'divider', 'slider']) $(id).hidden = !comparing;
  if (!comparing) return;
  const frame = frameOf(held.photo);
  const share = $('share').value / 100;
  Object.assign($('photo').style, { left: frame.left + 'px', top: frame.top + 'px',
    width: frame.width + 'px', height: frame.height + 'px',
    clipPath: `inset(0 ${100 - 100 * share}% 0 0)` });
  Object.assign($('slider').style, { left: Math.max(8, frame.left - 8) + 'px',
    width: Math.min(stage.clientWidth - 16, frame.width + 16) + 'px' });
  Object.assign($('divider').style, { left: frame.left + share * frame.width + 'px',
    top: frame.top + 'px', height: frame.height + 'px' });
};

// A photo belongs to the time at which it was taken.
const goTo = (index, { glide = true, keepTime = false } = {}) => {
  const photo = photos[index];
  const camera = viewer.app.root.findByName('camera');
  held = { photo, since: glide ? performance.now() : -Infinity,
           from: { position: camera.getPosition().clone(), rotation: camera.getRotation().clone(),
                   fov: camera.camera.fov, long: camera.camera.horizontalFov } };
  Object.assign(viewer.annotations[index].camera.initial, cameraOf(photo));
  viewer.selectAnnotation(index);  // where one goes on from when one lets go of the photo
  if (player && !keepTime) player.showShown();
  press($('film'), false);
  press($('turn'), false);
  viewer.state.animationPaused = true;
  $('photo').src = pictureOf(photo);
  for (const button of $('photos').children) press(button, Number(button.dataset.index) === index);
  frame?.onHeld(photo);
  say(photo.name + (index === facts.key ? ' (key view)' : photo.held_out ? ' (held out)' : ''));
  layOut();
  viewer.app.renderNextFrame = true;
};

const letGo = () => {
  if (!held) return;
  if (held.film) {  // the viewer goes on from here
    Object.assign(viewer.annotations[facts.key].camera.initial, cameraOf(held.photo));
    viewer.selectAnnotation(facts.key);
    press($('film'), false);
  }
  held = null;
  frame?.onHeld(null);
  press($('compare'), false);
  for (const button of $('photos').children) press(button, false);
  say('');
  layOut();
};

// Holds the camera of the film, which moves with the time.
const followFilm = (on) => {
  if (!on) return letGo();
  goTo(facts.key, { keepTime: true });
  for (const button of $('photos').children) press(button, false);
  Object.assign(held, { film: true, photo: player.camera() });
  press($('film'), true);
  say('The camera of the film');
  layOut();
};

// After the viewer has placed its camera: while a photo is held, the camera is the photo's.
const placeCamera = () => {
  if (player) player.tick();
  if (!held) return;
  if (held.film) held.photo = player.camera();
  const entity = viewer.app.root.findByName('camera');
  const { photo, from, since } = held;
  const t = Math.min(1, (performance.now() - since) / 700);
  const ease = t * t * (3 - 2 * t);
  const Vec3 = from.position.constructor, Quat = from.rotation.constructor;
  entity.setPosition(new Vec3().lerp(from.position, new Vec3(...photo.position), ease));
  entity.setRotation(new Quat().slerp(from.rotation, new Quat(...photo.rotation), ease));
  let before = from.fov * Math.PI / 360;
  if (from.long) {
    before = Math.atan(Math.tan(before) * stage.clientHeight / stage.clientWidth);
  }
  const fov = (1 - ease) * before * 360 / Math.PI + ease * fovOf(photo);
  entity.camera.horizontalFov = false;
  entity.camera.fov = fov;
  if (t < 1) viewer.app.renderNextFrame = true;
};

// ---- the movie in the page ----------------------------------------------------------------------
let movieUrl = null;
const movieAddress = async () => {
  if (!movieUrl) {
    const bytes = await (await bytesOf($('movie-file').textContent)).arrayBuffer();
    movieUrl = URL.createObjectURL(new Blob([bytes], { type: 'video/mp4' }));
  }
  return movieUrl;
};
const showMovie = async (on) => {
  const movie = $('movie');
  if (on && !movie.src) movie.src = await movieAddress();
  movie.hidden = !on;
  press($('see-movie'), on);
  const start = (then) => movie.play().catch(then);
  // Where pages may not sound by themselves, they play in silence, and people turn it on.
  if (on) start(() => { movie.muted = true; start(() => {}); });
  else movie.pause();
};
// What moves here cannot be played in 3D: it follows a field, not windows of time.
const wireMovie = () => {
  if (!facts.movie || !facts.movie.moves || facts.motion) return;
  const button = $('see-movie');
  button.hidden = false;
  button.onclick = () => {
    const on = button.getAttribute('aria-pressed') !== 'true';
    showMovie(on);
    say(on ? 'The film, drawn from the scene' : kStands);
  };
};
const kStands = 'This scene moves in a way that cannot be played in 3D here: it stands at one moment. ' +
  'Film shows how it moves';

const fillPhotos = () => {
  photos.forEach((photo, index) => {
    const button = document.createElement('button');
    button.dataset.index = index;
    button.title = photo.name;
    if (photo.jpeg) {
      const image = document.createElement('img');
      image.alt = '';
      image.src = pictureOf(photo);
      button.appendChild(image);
    }
    const name = document.createElement('span');
    name.textContent = (index === facts.key ? '★ ' : '') + photo.name;
    button.appendChild(name);
    button.onclick = () => goTo(index);
    $('photos').appendChild(button);
  });
};

const wirePanels = () => {
  const toggle = (id, panel) => {
    $(id).onclick = () => {
      $(panel).hidden = !$(panel).hidden;
      press($(id), !$(panel).hidden);
      if (panel === 'photos' && !$('photos').children.length) fillPhotos();
    };
  };
  toggle('list', 'photos');
  toggle('info', 'about');
  $('about').textContent = facts.about;
};

const wireButtons = () => {
  for (const button of document.querySelectorAll('[data-shades]')) {
    button.onclick = () => showShades(Number(button.dataset.shades));
  }
  const sureness = document.querySelector('[data-shades="2"]');
  if (!facts.confidence) {
    sureness.disabled = true;
    sureness.title = 'This scene does not know where its colours come from';
  }
  for (const [hex, text] of Object.values(shades)) {
    const item = document.createElement('span');
    item.innerHTML = `<i style="background:${hex}"></i>`;
    item.append(text);
    $('legend').appendChild(item);
  }
  $('home').onclick = () => goTo(facts.key);
  $('compare').onclick = () => {
    const on = $('compare').getAttribute('aria-pressed') !== 'true';
    press($('compare'), on);
    if (on && !(held && held.photo.jpeg)) goTo(facts.key);
    layOut();
  };
  $('share').oninput = layOut;
  $('turn').onclick = () => {
    const on = $('turn').getAttribute('aria-pressed') !== 'true';
    letGo();
    press($('turn'), on);
    if (on) viewer.state.cameraMode = 'anim';
    viewer.state.animationPaused = !on;
    if (!on) viewer.state.cameraMode = 'orbit';
  };
  const canvas = document.querySelector('#viewer canvas');
  for (const event of ['pointerdown', 'wheel']) canvas.addEventListener(event, () => {
    letGo();
    press($('turn'), false);
  }, { capture: true, passive: true });
  new ResizeObserver(layOut).observe(stage);
};

// What framed.js needs of this page.
const hooksOfFrame = () => {
  const entity = viewer.app.root.findByName('camera');
  const Vec3 = entity.getPosition().constructor;
  const numbers = ({ x, y, z }) => [x, y, z];
  const canvas = document.querySelector('#viewer canvas');
  let centers = null;
  let shown = 0;  // mode of the shades
  const setTone = (tone) => {
    splats.setParameter('uTone', tone);
    viewer.app.renderNextFrame = true;
  };
  const still = color3dTonedStill.attach({ app: viewer.app, canvas, above: $('viewer'), setTone,
    camera: () => [...entity.getWorldTransform().data, entity.camera.fov, canvas.width, canvas.height].join() });
  return {
    photos, stage, canvas, goTo,
    showShades: (mode) => {
      if (mode === shown) return;
      shown = mode;
      still.forget();
      showShades(mode);
    },
    showChanges: (changes) => {
      still.forget();
      ['colorChangeA', 'colorChangeB'].forEach((name, channel) => {
        if (!changes) return;
        const texture = splats.resource.getTexture(name), texels = texture.lock();
        for (let i = 0; 2 * i < changes.length; ++i) texels[i] = changes[2 * i + channel];
        texture.unlock();
      });
      splats.setParameter('uChanged', changes ? 1 : 0);
      viewer.app.renderNextFrame = true;
    },
    showTone: (tone) => (shown === 0 && !player ? still.show(tone) : setTone(tone)),
    held: () => held && !held.film && performance.now() - held.since > 700
      ? { photo: held.photo, frame: frameOf(held.photo) } : null,
    eye: () => numbers(entity.getPosition()),
    ray: (x, y) => {
      const at = entity.camera.screenToWorld(x, y, 1);
      return numbers(at.sub(entity.getPosition()).normalize());
    },
    centers: () => {
      if (centers) return centers;
      const local = splats.resource.centers, world = splats.entity.getWorldTransform(), point = new Vec3();
      centers = new Float32Array(local.length);
      for (let i = 0; i < local.length; i += 3) {
        world.transformPoint(point.set(local[i], local[i + 1], local[i + 2]), point);
        centers.set(numbers(point), i);
      }
      return centers;
    },
  };
};

// The scene stands upright here, and each Gaussian gets its sureness, before anything is drawn.
const prepare = (entity, confidence) => {
  const { rotation, scale, position } = facts.frame;
  const Vec3 = entity.getLocalPosition().constructor;
  entity.setLocalRotation(...rotation);
  entity.setLocalScale(scale, scale, scale);
  entity.setLocalPosition(...position);
  splats = entity.gsplat;
  const resource = splats.resource;
  const kByte = 52;
  resource.format.addExtraStreams([{ name: 'colorSureness', format: kByte },
                                   { name: 'colorChangeA', format: kByte }, { name: 'colorChangeB', format: kByte },
                                   ...(player ? color3dMotion.streams : [])]);
  resource.streams.syncWithFormat(resource.format);
  const texture = resource.getTexture('colorSureness');
  const texels = texture.lock();
  texels.fill(255);
  if (confidence) texels.set(confidence);
  texture.unlock();
  splats.setParameter('uShades', 0);
  splats.setParameter('uTone', [1, 0, 1, 0]);
  splats.setParameter('uChanged', 0);
  for (const [name, [hex]] of Object.entries(shades)) splats.setParameter(name, rgb(hex));
  if (player) player.attach(splats, !viewer.app.graphicsDevice.isWebGPU);
  const still = { declare: '', center: '', rotation: '', color: '' };
  splats.setWorkBufferModifier({ glsl: color3dShading.glsl(player ? color3dMotion.glsl : still),
                                 wgsl: color3dShading.wgsl(player ? color3dMotion.wgsl : still) });
};

const start = async () => {
  wirePanels();
  $('poster').src = 'data:image/jpeg;base64,' + facts.poster;
  if (typeof DecompressionStream === 'undefined' ||
      !document.createElement('canvas').getContext('webgl2')) {
    throw new Error('This browser has no WebGL 2, which drawing in 3D needs; turn on hardware ' +
      'acceleration in its settings, or open the page in another browser');
  }
  const createViewer = await loadProgram();
  const packed = facts.packed ? unpacked : bytesOf;
  let hand;
  const contents = new Promise((resolve) => { hand = resolve; });
  viewer = await createViewer({
    container: $('viewer'), settings: settingsOf(), contentUrl: 'scene', contentFilename: facts.scene,
    contents, ui: false, noanim: true,
    renderer: new URL(location.href).searchParams.has('webgpu') ? 'webgpu' : 'webgl',
  });
  if (facts.motion) {
    const motion = color3dMotion.read(await (await unpacked($('motion').textContent)).arrayBuffer());
    const draw = () => { viewer.app.renderNextFrame = true; };
    const show = (t) => { splats.setParameter('uTime', t); draw(); };
    player = color3dPlayer(facts.motion, motion, { draw, show, followFilm });
  }
  const confidence = facts.confidence &&
    new Uint8Array(await (await unpacked(facts.confidence)).arrayBuffer());
  color3dShading.likeOurs(viewer.app.scene.gsplat);
  // Sureness comes in the file's order, so the viewer has to keep it.
  for (const asset of viewer.app.assets.list()) {
    asset.data.reorder = false;
    asset.on('error', fail);
  }
  viewer.app.root.on('childinsert', (entity) => {
    if (entity.gsplat) prepare(entity, confidence);
  });
  viewer.app.on('update', placeCamera);
  if (player) viewer.app.scene.on('gsplat:sorted', player.onSorted);
  viewer.events.on('loaded:changed', async () => {
    viewer.state.cameraMode = 'orbit';
    wireButtons();
    if (player) player.wire(facts.movie && facts.movie.sound ? await movieAddress() : null);
    wireMovie();
    goTo(facts.key, { glide: false });
    if (window.parent !== window) frame = color3dFramed.connect(hooksOfFrame());
    say(facts.movie && facts.movie.moves && !facts.motion ? kStands
      : 'Drag to turn, wheel or pinch to come nearer, right drag or two fingers to move');
    document.body.dataset.state = 'ready';
  });
  hand(packed($('scene').textContent));
};

const fail = (error) => {
  document.body.dataset.state = 'failed';
  for (const button of document.querySelectorAll('nav button:not(#info)')) button.disabled = true;
  say(`${error.message || error}. Here is a ${facts.movie ? 'movie' : 'picture from the key view'} instead.`);
  if (facts.movie) showMovie(true);
};
start().catch(fail);
})();
