// The bar that plays a scene in time: slider, play, speed, loop, camera of the film. Time is t, from
// -1 to 1 over the motion; the bar counts seconds or, for scenes without a clock, steps.
const color3dPlayer = (facts, motion, hooks) => {
'use strict';
const $ = (id) => document.getElementById(id);
const press = (button, on) => button.setAttribute('aria-pressed', String(on));
const pressed = (button) => button.getAttribute('aria-pressed') === 'true';
const span = motion.end - motion.begin || 1;
const kSortMs = 100;  // at most so often the sorter is told where Gaussians are
const kMaxResends = 6;
const kFine = 10;     // stops of the slider between two time steps

let share = 0;        // of the time, 0..1
let playing = false, last = 0;
let follow = null, resource = null, sortedAt = -Infinity, sortedShare = NaN;
let resends = 0, again = 0;

const slider = $('moment');
slider.max = String(kFine * (facts.steps - 1));
slider.step = '1';

const label = () => facts.in_seconds
  ? `${(share * span).toFixed(2)} / ${span.toFixed(2)} s`
  : `${Math.round(share * (facts.steps - 1)) + 1} / ${facts.steps}`;

// The viewer sorts in a worker by the centers of the resource; WebGPU sorts what the shader moved.
const sort = (now) => {
  if (!follow || share === sortedShare || now - sortedAt < kSortMs) return;
  sortedAt = now;
  sortedShare = share;
  follow.moveTo(2 * share - 1);
  ++resource.centersVersion;
  hooks.draw();
};

const showShare = (value, fromSlider = false) => {
  share = Math.min(1, Math.max(0, value));
  if (!fromSlider) slider.value = String(Math.round(share * slider.max));
  const text = label();
  $('clock').textContent = text;
  slider.setAttribute('aria-valuetext', text.replace('/', 'of'));
  resends = 0;
  again = 1;
};

// The sound of the film runs along, and what moves goes by it while it is heard. It is set right when it is off by more
// than kApart seconds, or kApartAtRest; one seek after the other, as Chromium never ends a seek to the time of an earlier
// one that goes on.
const kApart = 0.3, kApartAtRest = 0.01;
let sound = null;
const hear = () => {
  if (!sound) return;
  const now = Math.min(share * facts.seconds, sound.duration || 0);
  const on = playing && pressed($('sound'));
  sound.playbackRate = Number($('speed').value);
  const most = on && !sound.paused ? kApart * Math.max(1, sound.playbackRate) : kApartAtRest;
  if (!sound.seeking && Math.abs(sound.currentTime - now) > most) sound.currentTime = now;
  if (on && sound.paused && !sound.ended) sound.play().catch(() => {});
  else if (!on && !sound.paused) sound.pause();
};

const play = (on) => {
  if (on && share >= 1) showShare(0);
  playing = on;
  hear();
  last = performance.now();
  press($('play'), on);
  $('play').textContent = on ? 'Pause' : 'Play';
};

// The viewer forgets a change of time that meets a new order of Gaussians, so the time is sent again
// after an order has come; a few times for each change, because sending it asks for another order.
const onSorted = () => {
  if (resends >= kMaxResends) return;
  ++resends;
  again = 2;
};

// The share of the time that is heard, after `seconds` more; NaN: none is, or it stands still.
let lastHeard = NaN, stuck = 0;
const heard = (seconds) => {
  if (!sound || sound.paused || sound.ended || sound.seeking) return NaN;
  stuck = sound.currentTime === lastHeard ? stuck + seconds : 0;
  lastHeard = sound.currentTime;
  return stuck < kApart ? lastHeard / facts.seconds : NaN;
};

// Once for each frame of the browser.
const tick = () => {
  const now = performance.now();
  if (playing) {
    const passed = Math.min(1, (now - last) / 1000), speed = Number($('speed').value);
    const byClock = share + passed * speed / facts.seconds, bySound = heard(passed);
    const isNear = Math.abs(bySound - byClock) * facts.seconds < kApart * Math.max(1, speed);
    const next = isNear ? Math.max(share, bySound) : byClock;
    if (next < 1) {
      showShare(next);
    } else if (pressed($('loop'))) {
      showShare(next % 1);
    } else {
      showShare(1);
      play(false);
    }
    hear();
  }
  last = now;
  sort(now);
  if (again > 0) {
    --again;
    hooks.show(2 * share - 1);
  }
};

// One time step, or a tenth of one, on.
const step = (steps) => {
  play(false);
  showShare(share + steps / Math.max(1, facts.steps - 1));
  hear();
};

// Space plays, comma and full stop go one time step, wherever the focus is not on a control that
// uses the key itself. The viewer does not see these keys.
const onKey = (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const on = event.target.closest?.('button, select, input, a');
  if (event.key === ' ' && !(on && on !== slider)) play(!playing);
  else if (event.key === ',') step(-1);
  else if (event.key === '.') step(1);
  else if (!(on === slider || on?.id === 'speed')) return;
  else return event.stopPropagation();  // the control's own key
  event.preventDefault();
  event.stopPropagation();
};

// The camera of the film at this time, interpolated between its frames.
const camera = () => {
  const film = facts.film, time = motion.begin + share * span;
  let next = 1;
  while (next < film.length - 1 && film[next].time < time) ++next;
  const from = film[Math.min(next, film.length) - 1], to = film[Math.min(next, film.length - 1)];
  const gap = to.time - from.time;
  const part = gap > 0 ? Math.min(1, Math.max(0, (time - from.time) / gap)) : 0;
  const mix = (a, b, sign = 1) => a.map((x, k) => (1 - part) * x + part * sign * b[k]);
  const dot = from.rotation.reduce((sum, x, k) => sum + x * to.rotation[k], 0);
  const rotation = mix(from.rotation, to.rotation, dot < 0 ? -1 : 1);
  const length = Math.hypot(...rotation);
  return { jpeg: '', aspect: from.aspect, position: mix(from.position, to.position),
           rotation: rotation.map((x) => x / length), target: mix(from.target, to.target),
           tan: (1 - part) * from.tan + part * to.tan, center: mix(from.center, to.center) };
};

// `soundAddress`: of the film's sound; null: it has none.
const wire = (soundAddress) => {
  $('time').hidden = false;
  $('sound').hidden = !soundAddress;
  if (soundAddress) {
    sound = $('heard');
    sound.src = soundAddress;
    sound.onloadedmetadata = sound.onseeked = hear;
    $('sound').onclick = () => {
      press($('sound'), !pressed($('sound')));
      hear();
    };
  }
  slider.oninput = () => {
    play(false);
    showShare(slider.value / slider.max, true);
    hear();
  };
  $('play').onclick = () => play(!playing);
  $('loop').onclick = () => press($('loop'), !pressed($('loop')));
  $('film').hidden = facts.film.length < 2;
  $('film').onclick = () => hooks.followFilm(!pressed($('film')));
  window.addEventListener('keydown', onKey, { capture: true });
  showShown();
};
// The time of the photos.
const showShown = () => {
  play(false);
  showShare((facts.shown - motion.begin) / span);
  hear();
};

// Gives the viewer's Gaussians their motion. Their box grows to where they move, since the viewer
// sorts within it.
const attach = (gsplat, sortedByWorker) => {
  const { most, window: range } = motion;
  gsplat.setParameter('uTime', 2 * share - 1);
  gsplat.setParameter('uWindow', range);
  gsplat.setParameter('uMost', most);
  resource = gsplat.resource;
  color3dMotion.fill(motion, resource);
  if (!motion.count || !resource.centers) return;
  const places = color3dMotion.followed(motion, resource.centers);
  const { least, most: corner } = places.box();
  const all = resource.aabb.clone(), reached = resource.aabb.clone();
  const Vec3 = all.center.constructor;
  reached.setMinMax(new Vec3(...least), new Vec3(...corner));
  all.add(reached);
  gsplat.customAabb = all;
  if (sortedByWorker) follow = places;
};

return { attach, wire, tick, onSorted, camera, showShown };
};
