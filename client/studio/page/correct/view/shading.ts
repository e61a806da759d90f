// Draws pictures from their parts: grey photo, colours, sources, pull. On the graphics card where there is WebGL 2,
// else by the processor; both compute the same (shade).
import { labFromBytes, srgbFromLabUnclamped } from '../../paint/color/lab';
import { reached, visible } from '../model/heat';
import { toned, type Gain } from '../model/tone';

export type Mode = 'photo' | 'color' | 'source' | 'pull';
export interface Parts {
  readonly photo: ImageBitmap; // grey
  readonly color: ImageBitmap | null; // R, G: (a, b + 128) / 255
  readonly source: ImageBitmap | null; // shares: R guessed, G seen, B inferred
  readonly pull: ImageBitmap | null;
}
export interface Look { readonly mode: Mode; readonly gain: Gain; readonly reach: number }
// Part of the picture that is drawn, in shares of it.
export interface Crop { readonly x: number; readonly y: number; readonly width: number; readonly height: number }
export const whole: Crop = { x: 0, y: 0, width: 1, height: 1 };

// The shades of the page of a scene (core/view/page/page.js) and of the report.
export const sourceShades = {
  seen: '#6fb7b0', inferred: '#e0b25f', guessed: '#b873a0',
} as const;
const rgbOf = (hex: string): [number, number, number] =>
  [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255) as [number, number, number];
const seen = rgbOf(sourceShades.seen);
const inferred = rgbOf(sourceShades.inferred);
const guessed = rgbOf(sourceShades.guessed);
const cold = [0.82, 0.33, 0.06];
const hot = [1, 0.9, 0.45];

type Rgb = [number, number, number];
// One pixel, bytes of the parts; 0..1. For tests, and where there is no graphics card.
export const shade = (
  gray: number, color: readonly [number, number] | null, source: readonly [number, number, number] | null, pull: number, look: Look,
): Rgb => {
  const photo = gray / 255;
  if (look.mode === 'source' && source) {
    const all = Math.max(1, source[0] + source[1] + source[2]);
    return [0, 1, 2].map((c) => ((source[0] * guessed[c]! + source[1] * seen[c]! + source[2] * inferred[c]!) / all) *
      (0.15 + 0.95 * photo)).map((v) => Math.min(1, v)) as Rgb;
  }
  if (look.mode === 'pull') {
    const heat = reached(pull / 255, look.reach);
    const opacity = heat < visible ? 0 : 0.25 + 0.6 * heat;
    return [0, 1, 2].map((c) => {
      const warm = cold[c]! + (hot[c]! - cold[c]!) * heat;
      return 0.75 * photo * (1 - opacity) + opacity * warm * (0.35 + 0.65 * photo);
    }) as Rgb;
  }
  if (look.mode !== 'color' || !color) return [photo, photo, photo];
  const lab = { l: labFromBytes(gray, gray, gray).l, a: color[0] - 128, b: color[1] - 128 };
  const { r, g, b } = srgbFromLabUnclamped(toned(lab, look.gain));
  return [r, g, b].map((v) => Math.min(1, Math.max(0, v))) as Rgb;
};

const vertex = `#version 300 es
uniform vec4 uCrop;
out vec2 at;
void main() {
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  at = uCrop.xy + uCrop.zw * vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`;
const vec3 = (values: readonly number[]): string => `vec3(${values.map((v) => v.toFixed(6)).join(',')})`;
const fragment = `#version 300 es
precision highp float;
uniform sampler2D uPhoto, uColor, uSource, uPull;
uniform int uMode;
uniform vec4 uGain;
uniform float uReach;
in vec2 at;
out vec4 drawn;
vec3 encode(vec3 v) {
  v = clamp(v, 0.0, 1.0);
  return mix(12.92 * v, 1.055 * pow(max(v, 1e-6), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
}
void main() {
  float photo = texture(uPhoto, at).r;
  vec3 rgb = vec3(photo);
  if (uMode == 1) {
    float y = photo <= 0.04045 ? photo / 12.92 : pow((photo + 0.055) / 1.055, 2.4);
    float fy = y > 0.008856452 ? pow(y, 1.0 / 3.0) : (903.2963 * y + 16.0) / 116.0;
    vec2 ab = texture(uColor, at).rg * 255.0 - 128.0;
    ab = uGain.xz * ab + uGain.yw * 116.0 * fy;
    vec3 f = vec3(fy + ab.x / 500.0, fy, fy - ab.y / 200.0);
    vec3 xyz = mix((116.0 * f - 16.0) / 903.2963, f * f * f, step(6.0 / 29.0, f));
    rgb = encode(vec3(dot(xyz, vec3(3.079955, -1.537139, -0.542816)), dot(xyz, vec3(-0.921259, 1.876011, 0.045248)),
                      dot(xyz, vec3(0.052887, -0.204026, 1.151138))));
  } else if (uMode == 2) {
    vec3 shares = texture(uSource, at).rgb;
    vec3 hue = (shares.r * ${vec3(guessed)} + shares.g * ${vec3(seen)} + shares.b * ${vec3(inferred)}) /
      max(1.0 / 255.0, shares.r + shares.g + shares.b);
    float stripe = mod(floor((gl_FragCoord.x - gl_FragCoord.y) / 4.0), 2.0);
    rgb = hue * (0.15 + 0.95 * photo) * (1.0 - 0.4 * stripe * shares.r);
  } else if (uMode == 3) {
    float heat = pow(max(texture(uPull, at).r, 1e-6), 1.0 / uReach);
    float opacity = heat < ${visible.toFixed(4)} ? 0.0 : 0.25 + 0.6 * heat;
    rgb = mix(0.75 * rgb, mix(${vec3(cold)}, ${vec3(hot)}, heat) * (0.35 + 0.65 * photo), opacity);
  }
  drawn = vec4(min(rgb, 1.0), 1.0);
}`;

const modes: Mode[] = ['photo', 'color', 'source', 'pull'];
// Without its map a picture is shown as the photo.
const modeOf = ({ mode }: Look, parts: Parts): Mode =>
  (mode === 'color' && !parts.color) || (mode === 'source' && !parts.source) || (mode === 'pull' && !parts.pull) ? 'photo' : mode;

// Draws by WebGL into one canvas, which is copied: browsers limit the number of contexts.
class CardShader {
  private readonly textures = new Map<ImageBitmap, WebGLTexture>();

  private constructor(private readonly canvas: OffscreenCanvas, private readonly gl: WebGL2RenderingContext,
    private readonly uniforms: Record<string, WebGLUniformLocation>) {}

  static make(): CardShader | null {
    const canvas = new OffscreenCanvas(16, 16);
    const gl = canvas.getContext('webgl2', { antialias: false, alpha: false, preserveDrawingBuffer: true });
    const program = gl?.createProgram();
    if (!gl || !program) return null;
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      if (!gl.isContextLost()) console.warn('the pictures are drawn by the processor:', gl.getProgramInfoLog(program));
      return null;
    }
    gl.useProgram(program);
    const uniforms: Record<string, WebGLUniformLocation> = {};
    for (const name of ['uCrop', 'uMode', 'uGain', 'uReach', 'uPhoto', 'uColor', 'uSource', 'uPull']) {
      uniforms[name] = gl.getUniformLocation(program, name)!;
    }
    ['uPhoto', 'uColor', 'uSource', 'uPull'].forEach((name, unit) => gl.uniform1i(uniforms[name]!, unit));
    return new CardShader(canvas, gl, uniforms);
  }

  get isLost(): boolean {
    return this.gl.isContextLost();
  }

  draw(target: CanvasRenderingContext2D, parts: Parts, look: Look, crop: Crop): void {
    const { gl, canvas } = this;
    const { width, height } = target.canvas;
    if (canvas.width < width || canvas.height < height) {
      canvas.width = Math.max(canvas.width, width);
      canvas.height = Math.max(canvas.height, height);
    }
    gl.viewport(0, canvas.height - height, width, height);
    gl.uniform4f(this.uniforms.uCrop!, crop.x, crop.y, crop.width, crop.height);
    gl.uniform1i(this.uniforms.uMode!, modes.indexOf(modeOf(look, parts)));
    gl.uniform4f(this.uniforms.uGain!, ...look.gain);
    gl.uniform1f(this.uniforms.uReach!, look.reach);
    [parts.photo, parts.color, parts.source, parts.pull].forEach((bitmap, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, this.textureOf(bitmap ?? parts.photo));
    });
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    target.drawImage(canvas, 0, 0, width, height, 0, 0, width, height);
  }

  forget(bitmap: ImageBitmap): void {
    const texture = this.textures.get(bitmap);
    if (texture) this.gl.deleteTexture(texture);
    this.textures.delete(bitmap);
  }

  private textureOf(bitmap: ImageBitmap): WebGLTexture {
    const known = this.textures.get(bitmap);
    if (known) return known;
    const { gl } = this;
    const texture = gl.createTexture()!;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]] as const) {
      gl.texParameteri(gl.TEXTURE_2D, name, value);
    }
    this.textures.set(bitmap, texture);
    return texture;
  }
}

// The pixels of a part, at the size of the drawing.
export const pixelsOf = (bitmap: ImageBitmap, width: number, height: number, crop: Crop = whole): Uint8ClampedArray => {
  const context = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true })!;
  context.drawImage(bitmap, crop.x * bitmap.width, crop.y * bitmap.height, crop.width * bitmap.width, crop.height * bitmap.height,
    0, 0, width, height);
  return context.getImageData(0, 0, width, height).data;
};

const drawByProcessor = (target: CanvasRenderingContext2D, parts: Parts, look: Look, crop: Crop): void => {
  const { width, height } = target.canvas;
  const [photo, color, source, pull] = [parts.photo, parts.color, parts.source, parts.pull]
    .map((part) => (part ? pixelsOf(part, width, height, crop) : null));
  const drawn = target.createImageData(width, height);
  const known = { ...look, mode: modeOf(look, parts) };
  for (let i = 0; i < drawn.data.length; i += 4) {
    const rgb = shade(photo![i]!, color && [color[i]!, color[i + 1]!], source && [source[i]!, source[i + 1]!, source[i + 2]!],
      pull ? pull[i]! : 0, known);
    for (let c = 0; c < 3; ++c) drawn.data[i + c] = 255 * rgb[c]!;
    drawn.data[i + 3] = 255;
  }
  target.putImageData(drawn, 0, 0);
};

export class Shader {
  private card = CardShader.make();

  // Fills the canvas of `target` with the part `crop` of the picture.
  draw(target: CanvasRenderingContext2D, parts: Parts, look: Look, crop: Crop = whole): void {
    if (this.card?.isLost) this.card = CardShader.make();
    if (this.card) this.card.draw(target, parts, look, crop);
    else drawByProcessor(target, parts, look, crop);
  }
  // To be called before a bitmap is closed.
  forget(bitmap: ImageBitmap): void {
    this.card?.forget(bitmap);
  }
}
