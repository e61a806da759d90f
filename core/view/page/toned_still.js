// Shows a scene in other tones (framed.js) at once: while the tone changes and the camera stands still,
// a picture of the scene in its plain tone is drawn in them, above the scene. When the tone rests, the
// scene itself is drawn in it. Without WebGL 2 every tone is drawn by the scene.
const color3dTonedStill = (() => {
'use strict';
const kRest = 600;  // ms after the newest tone was drawn
const kPlain = [1, 0, 1, 0];

const vertex = `#version 300 es
out vec2 at;
void main() {
  at = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  gl_Position = vec4(2.0 * at - 1.0, 0.0, 1.0);
}`;
const fragment = (statement) => `#version 300 es
precision highp float;
uniform sampler2D uPicture;
in vec2 at;
out vec4 drawn;
${color3dShading.toned}
void main() {
  vec3 picture = texture(uPicture, at).rgb;
  drawn = vec4(${statement}, 1.0);
}`;
// Lab in 10 bits each: the picture is converted once, and every tone goes on from there.
const toStored = fragment('labOf(picture) / vec3(256.0, 256.0, 128.0) + vec3(0.5, 0.5, 0.0)');
const fromStored = fragment('inTone((picture - vec3(0.5, 0.5, 0.0)) * vec3(256.0, 256.0, 128.0))');

const makeProgram = (gl, text) => {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, text]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  return gl.getProgramParameter(program, gl.LINK_STATUS) ? program : null;
};
const makeTexture = (gl) => {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
                               [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  }
  return texture;
};

// Draws pictures in tones to its canvas; null without WebGL 2.
const makePainter = () => {
  const canvas = document.createElement('canvas');
  const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false });
  const [convert, paint] = gl ? [toStored, fromStored].map((text) => makeProgram(gl, text)) : [];
  if (!convert || !paint) return null;
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
  const picture = makeTexture(gl), stored = makeTexture(gl);
  const target = gl.createFramebuffer();
  const tone = gl.getUniformLocation(paint, 'uTone');
  const draw = (program, texture) => {
    gl.useProgram(program);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  };
  return {
    canvas,
    take: (source) => {
      const { width, height } = source;
      Object.assign(canvas, { width, height });
      gl.viewport(0, 0, width, height);
      gl.bindTexture(gl.TEXTURE_2D, stored);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB10_A2, width, height, 0, gl.RGBA, gl.UNSIGNED_INT_2_10_10_10_REV, null);
      gl.bindTexture(gl.TEXTURE_2D, picture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, source);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, stored, 0);
      draw(convert, picture);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    },
    draw: (values) => {
      if (gl.isContextLost()) return false;
      gl.useProgram(paint);
      gl.uniform4f(tone, ...values);
      draw(paint, stored);
      return true;
    },
  };
};

// app: of the viewer; canvas: what it draws on; above: the element after which the still is laid;
// camera(): text that changes with the view; setTone(tone): has the scene drawn in the tone, at the next frame.
const attach = ({ app, canvas, above, camera, setTone }) => {
  let painter;           // undefined: not asked for yet
  let tone = kPlain;     // wanted
  let taken = null;      // camera() of the picture that the painter has
  let state = 'resting'; // or 'taking': the next frame becomes the picture; 'showing' it; 'leaving': the next frame replaces it
  let timer;

  const rest = () => {
    clearTimeout(timer);
    if (state === 'resting') return;
    state = 'leaving';
    setTone(tone);
  };
  const paint = () => {
    if (!painter.draw(tone)) return rest();
    painter.canvas.hidden = false;
    state = 'showing';
    clearTimeout(timer);
    timer = setTimeout(rest, kRest);
  };
  const onFrame = () => {
    if (state === 'taking') {
      taken = camera();
      painter.take(canvas);
      paint();
    } else if (state === 'leaving') {
      painter.canvas.hidden = true;
      taken = null;
      state = 'resting';
    } else if (state === 'showing' && camera() !== taken) {
      rest();
    }
  };
  const begin = () => {
    painter = makePainter();
    if (!painter) return;
    Object.assign(painter.canvas, { id: 'still', hidden: true });
    above.after(painter.canvas);
    app.on('frameend', onFrame);
  };
  return {
    show: (wanted) => {
      if (state === 'resting' && wanted.join() === tone.join()) return;
      tone = wanted;
      if (painter === undefined) begin();
      if (!painter) return setTone(wanted);
      if (state === 'showing' || state === 'leaving') {
        paint();
      } else if (state !== 'taking') {
        state = 'taking';
        setTone(kPlain);
      }
    },
    // The scene has changed.
    forget: rest,
  };
};

return { attach };
})();
