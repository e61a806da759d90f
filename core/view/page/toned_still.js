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
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  at = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`;
const fragment = `#version 300 es
precision highp float;
uniform sampler2D uScene;
in vec2 at;
out vec4 drawn;
${color3dShading.toned}
void main() {
  drawn = vec4(toned(texture(uScene, at).rgb, vec2(0.0)), 1.0);
}`;

// Draws pictures in tones to its canvas; null without WebGL 2.
const makePainter = () => {
  const canvas = document.createElement('canvas');
  const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false });
  const program = gl && gl.createProgram();
  if (!program) return null;
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  gl.useProgram(program);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
                               [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  }
  const tone = gl.getUniformLocation(program, 'uTone');
  return {
    canvas,
    take: (picture) => {
      canvas.width = picture.width;
      canvas.height = picture.height;
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    },
    draw: (values) => {
      if (gl.isContextLost()) return false;
      gl.uniform4f(tone, ...values);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
      return true;
    },
  };
};

// app: of the viewer; canvas: what it draws on; above: the element after which the still is laid;
// camera(): text that changes with the view; setTone(tone): has the scene drawn in the tone, at the next frame.
const attach = ({ app, canvas, above, camera, setTone }) => {
  const painter = makePainter();
  if (!painter) return { show: setTone, forget: () => {} };
  const still = painter.canvas;
  still.id = 'still';
  still.hidden = true;
  above.after(still);
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
    still.hidden = false;
    state = 'showing';
    clearTimeout(timer);
    timer = setTimeout(rest, kRest);
  };
  app.on('frameend', () => {
    if (state === 'taking') {
      taken = camera();
      painter.take(canvas);
      paint();
    } else if (state === 'leaving') {
      still.hidden = true;
      taken = null;
      state = 'resting';
    } else if (state === 'showing' && camera() !== taken) {
      rest();
    }
  });
  return {
    show: (wanted) => {
      if (state === 'resting' && wanted.join() === tone.join()) return;
      tone = wanted;
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
