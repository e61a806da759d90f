// What colours of Gaussians become when they are drawn. `moved`: how they move (motion.js).
const color3dShading = (() => {
'use strict';
// Tone and changes of colours in Lab, with the constants of core/color/lab.cc.
const toned = `
uniform vec4 uTone;
// a, b and L + 16.
vec3 labOf(vec3 srgb) {
  vec3 encoded = clamp(srgb, 0.0, 1.0);
  vec3 linear = mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3(2.4)), step(0.04045, encoded));
  vec3 xyz = vec3(dot(linear, vec3(0.433950, 0.376210, 0.189840)),
                  dot(linear, vec3(0.212673, 0.715152, 0.072175)),
                  dot(linear, vec3(0.017757, 0.109468, 0.872775)));
  vec3 f = mix((903.2963 * xyz + 16.0) / 116.0, pow(max(xyz, 1e-6), vec3(1.0 / 3.0)), step(0.008856452, xyz));
  return vec3(500.0 * (f.x - f.y), 200.0 * (f.y - f.z), 116.0 * f.y);
}
vec3 inTone(vec3 lab) {
  float y = lab.z / 116.0;
  vec3 f = vec3(y + (uTone.x * lab.x + uTone.y * lab.z) / 500.0, y, y - (uTone.z * lab.y + uTone.w * lab.z) / 200.0);
  vec3 xyz = mix((116.0 * f - 16.0) / 903.2963, f * f * f, step(6.0 / 29.0, f));
  vec3 linear = clamp(vec3(dot(xyz, vec3(3.079955, -1.537139, -0.542816)),
                           dot(xyz, vec3(-0.921259, 1.876011, 0.045248)),
                           dot(xyz, vec3(0.052887, -0.204026, 1.151138))), 0.0, 1.0);
  return mix(12.92 * linear, 1.055 * pow(max(linear, 1e-6), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
}
vec3 toned(vec3 srgb, vec2 change) {
  return inTone(labOf(srgb) + vec3(change, 0.0));
}
`;
// Lightness that people see, as sRGB; shades for where a colour comes from, over the grey picture.
const glsl = (moved) => `
uniform float uShades;
uniform vec3 uGuessed;
uniform vec3 uInferred;
uniform vec3 uSeen;
uniform float uChanged;
${moved.declare}
${toned}void modifySplatCenter(inout vec3 center) {${moved.center}}
void modifySplatRotationScale(vec3 before, vec3 after, inout vec4 rotation, inout vec3 scale) {${moved.rotation}}
void modifySplatColor(vec3 center, inout vec4 color) {${moved.color}
  if (uShades < 0.5) {
    bool changed = uChanged > 0.5;
    if (changed || uTone != vec4(1.0, 0.0, 1.0, 0.0)) {
      vec2 change = changed ? vec2(loadColorChangeA().r, loadColorChangeB().r) * 255.0 - 128.0 : vec2(0.0);
      color.rgb = toned(color.rgb, change);
    }
    return;
  }
  vec3 linear = pow(clamp(color.rgb, 0.0, 1.0), vec3(2.2));
  float gray = pow(dot(linear, vec3(0.2126, 0.7152, 0.0722)), 1.0 / 2.2);
  if (uShades < 1.5) {
    color.rgb = vec3(gray);
    return;
  }
  float sure = loadColorSureness().r;
  vec3 shade = sure < 0.5 ? mix(uGuessed, uInferred, 2.0 * sure)
                          : mix(uInferred, uSeen, 2.0 * sure - 1.0);
  color.rgb = shade * (0.15 + 0.95 * gray);
}
`;
const wgsl = (moved) => `
uniform uShades: f32;
uniform uGuessed: vec3f;
uniform uInferred: vec3f;
uniform uSeen: vec3f;
uniform uTone: vec4f;
uniform uChanged: f32;
${moved.declare}
fn toned(srgb: vec3f, change: vec2f) -> vec3f {
  let encoded = clamp(srgb, vec3f(0.0), vec3f(1.0));
  var linear = mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3f(2.4)), step(vec3f(0.04045), encoded));
  var xyz = vec3f(dot(linear, vec3f(0.433950, 0.376210, 0.189840)),
                  dot(linear, vec3f(0.212673, 0.715152, 0.072175)),
                  dot(linear, vec3f(0.017757, 0.109468, 0.872775)));
  var f = mix((903.2963 * xyz + 16.0) / 116.0, pow(max(xyz, vec3f(1e-6)), vec3f(1.0 / 3.0)), step(vec3f(0.008856452), xyz));
  let a = 500.0 * (f.x - f.y) + change.x;
  let b = 200.0 * (f.y - f.z) + change.y;
  let bright = 116.0 * f.y;
  f.x = f.y + (uniform.uTone.x * a + uniform.uTone.y * bright) / 500.0;
  f.z = f.y - (uniform.uTone.z * b + uniform.uTone.w * bright) / 200.0;
  xyz = mix((116.0 * f - 16.0) / 903.2963, f * f * f, step(vec3f(6.0 / 29.0), f));
  linear = clamp(vec3f(dot(xyz, vec3f(3.079955, -1.537139, -0.542816)),
                       dot(xyz, vec3f(-0.921259, 1.876011, 0.045248)),
                       dot(xyz, vec3f(0.052887, -0.204026, 1.151138))), vec3f(0.0), vec3f(1.0));
  return mix(12.92 * linear, 1.055 * pow(max(linear, vec3f(1e-6)), vec3f(1.0 / 2.4)) - 0.055, step(vec3f(0.0031308), linear));
}
fn modifySplatCenter(center: ptr<function, vec3f>) {${moved.center}}
fn modifySplatRotationScale(before: vec3f, after: vec3f, rotation: ptr<function, vec4f>, scale: ptr<function, vec3f>) {${moved.rotation}}
fn modifySplatColor(center: vec3f, color: ptr<function, vec4f>) {${moved.color}
  if (uniform.uShades < 0.5) {
    let changed = uniform.uChanged > 0.5;
    if (changed || any(uniform.uTone != vec4f(1.0, 0.0, 1.0, 0.0))) {
      var change = vec2f(0.0);
      if (changed) { change = vec2f(f32(loadColorChangeA().r), f32(loadColorChangeB().r)) * 255.0 - 128.0; }
      *color = vec4f(toned((*color).rgb, change), (*color).a);
    }
    return;
  }
  let linear = pow(clamp((*color).rgb, vec3f(0.0), vec3f(1.0)), vec3f(2.2));
  let gray = pow(dot(linear, vec3f(0.2126, 0.7152, 0.0722)), 1.0 / 2.2);
  if (uniform.uShades < 1.5) {
    *color = vec4f(vec3f(gray), (*color).a);
    return;
  }
  let sure = f32(loadColorSureness().r);
  var shade = mix(uniform.uGuessed, uniform.uInferred, 2.0 * sure);
  if (sure >= 0.5) { shade = mix(uniform.uInferred, uniform.uSeen, 2.0 * sure - 1.0); }
  *color = vec4f(shade * (0.15 + 0.95 * gray), (*color).a);
}
`;

// The engine's falloff from the centre of a Gaussian is normalised to zero at 2.83 sigma. These chunks of its fragment
// shader turn it back into exp(-sigma^2 / 2), with the bounds of our rasterizer (core/splat/raster/raster_constants.h),
// up to that radius. `uv` is (0, 0) at the centre and 1 long at 2.83 sigma.
const falloff = {
  glsl: `
void modifySplatColor(vec2 uv, inout vec4 color) {
  float fall = exp(-4.0 * dot(uv, uv)), edge = exp(-4.0);
  float alpha = min(color.a * fall * (1.0 - edge) / max(fall - edge, 1e-5), 0.99);
  color.a = alpha < 1.0 / 255.0 ? 0.0 : alpha;
}
`,
  wgsl: `
fn modifySplatColor(uv: vec2f, color: ptr<function, vec4f>) {
  let fall = exp(-4.0 * dot(uv, uv));
  let edge = exp(-4.0);
  let alpha = min((*color).a * fall * (1.0 - edge) / max(fall - edge, 1e-5), 0.99);
  (*color).a = select(alpha, 0.0, alpha < 1.0 / 255.0);
}
`,
};

// Lets the engine draw what our rasterizer draws: its falloff, also of the smallest Gaussians, in the order of their
// depth. `gsplat` is the scene's, of the engine.
const likeOurs = (gsplat) => {
  for (const language of ['glsl', 'wgsl']) {
    gsplat.material.getShaderChunks(language).set('gsplatModifyPS', falloff[language]);
  }
  gsplat.material.update();
  gsplat.alphaClipForward = 1e-3;
  gsplat.minPixelSize = 0;
  gsplat.minContribution = 0;
  gsplat.radialSorting = false;
};

return { glsl, wgsl, toned, likeOurs };
})();
