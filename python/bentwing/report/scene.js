// SPDX-License-Identifier: MIT OR Apache-2.0
// The cloud of a report in the browser: WebGL 2 and nothing else, so that the page needs no network.
"use strict";
const startScene = (figure) => {
  const canvas = figure.querySelector("canvas");
  const data = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
  const gl = canvas.getContext("webgl2", { antialias: false });
  if (!gl) {
    figure.classList.add("off"); // the still pictures say the same
    return;
  }

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const shader = (type, source) => {
    const made = gl.createShader(type);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  };
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    gl.attachShader(made, shader(gl.VERTEX_SHADER, "#version 300 es\n" + vertex));
    gl.attachShader(made, shader(gl.FRAGMENT_SHADER, "#version 300 es\nprecision highp float;\n" + fragment));
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  };

  const points = program(
    `uniform mat4 camera; uniform vec3 origin; uniform float step, size; uniform vec2 heights;
     uniform bool byTime, isPath; uniform vec3 table[9];
     in vec3 place; in float value; out vec3 colour;
     vec3 shade(float x) {
       float at = clamp(x, 0.0, 1.0) * 8.0; int i = min(int(at), 7);
       return mix(table[i], table[i + 1], at - float(i));
     }
     void main() {
       vec3 p = origin + place * step;
       gl_Position = camera * vec4(p, 1.0);
       gl_PointSize = clamp(size / gl_Position.w, 1.5, 9.0);
       float x = byTime ? value : (p.z - heights.x) / max(heights.y - heights.x, 1e-6);
       colour = isPath ? mix(vec3(0.12, 0.16, 0.2), vec3(0.78, 0.25, 0.18), value) : shade(x);
     }`,
    `uniform bool isPath; in vec3 colour; out vec4 pixel;
     void main() {
       if (!isPath && distance(gl_PointCoord, vec2(0.5)) > 0.5) discard;
       pixel = vec4(colour, 1.0);
     }`);
  // Eye-dome lighting (Boucheny 2009): dark where neighbouring pixels are nearer to the viewer.
  const light = program(
    `out vec2 at;
     void main() { at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0; gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0); }`,
    `uniform sampler2D colours, depths; uniform vec2 pixelSize, range; in vec2 at; out vec4 pixel;
     float far(vec2 p) {
       float d = texture(depths, p).r * 2.0 - 1.0;
       return log2(2.0 * range.x * range.y / (range.y + range.x - d * (range.y - range.x)));
     }
     void main() {
       if (texture(depths, at).r >= 1.0) { pixel = vec4(1.0); return; }
       float here = far(at), hidden = 0.0;
       for (int k = 0; k < 8; k++) {
         float a = 0.7854 * float(k);
         hidden += max(0.0, here - far(at + 1.5 * pixelSize * vec2(cos(a), sin(a))));
       }
       pixel = vec4(texture(colours, at).rgb * (0.3 + 0.7 * exp(-6.0 * hidden)), 1.0);
     }`);

  const buffer = (places, values) => {
    const made = gl.createVertexArray();
    gl.bindVertexArray(made);
    for (const [name, n, kind, array] of [["place", 3, gl.UNSIGNED_SHORT, places], ["value", 1, gl.UNSIGNED_BYTE, values]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
      const at = gl.getAttribLocation(points, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, n, kind, name === "value", 0, 0);
    }
    return { made, n: values.length };
  };
  const cloud = buffer(bytes(data.points), bytes(data.times));
  const path = buffer(bytes(data.path), bytes(data.unsure));

  const target = gl.createFramebuffer();
  const texture = (inside, format, type, attachment) => {
    const made = gl.createTexture();
    const fit = (w, h) => {
      gl.bindTexture(gl.TEXTURE_2D, made);
      gl.texImage2D(gl.TEXTURE_2D, 0, inside, w, h, 0, format, type, null);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, made, 0);
    };
    return { made, fit };
  };
  const colours = texture(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, gl.COLOR_ATTACHMENT0);
  const depths = texture(gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, gl.DEPTH_ATTACHMENT);

  const oblique = { turn: -0.5, lift: 0.6 };
  const view = { ...oblique, far: 1.5 * data.radius, at: [...data.centre], byTime: false };

  // From map to clip coordinates; matrices are column-major.
  const axes = () => {
    const [ct, st, cl, sl] = [Math.cos(view.turn), Math.sin(view.turn), Math.cos(view.lift), Math.sin(view.lift)];
    return { right: [ct, st, 0], up: [-st * sl, ct * sl, cl], toward: [st * cl, -ct * cl, sl] };
  };
  const camera = (range) => {
    const { right, up, toward } = axes();
    const dot = (a) => a[0] * view.at[0] + a[1] * view.at[1] + a[2] * view.at[2];
    const f = 1.9, aspect = canvas.width / canvas.height, [near, far] = range;
    const a = (far + near) / (near - far), b = (2 * far * near) / (near - far);
    const row = (r, scale, shift) => [...r.map((x) => x * scale), -dot(r) * scale + shift];
    const x = row(right, f / aspect, 0), y = row(up, f, 0);
    const z = row(toward, a, -a * view.far + b), w = row(toward, -1, view.far);
    return [0, 1, 2, 3].flatMap((i) => [x[i], y[i], z[i], w[i]]);
  };

  const uniform = (which, name) => gl.getUniformLocation(which, name);
  const table = (codes) => codes.flatMap((c) => [0, 2, 4].map((i) => parseInt(c.slice(i, i + 2), 16) / 255));
  const draw = () => {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== w || canvas.height !== h || !draw.count) {
      [canvas.width, canvas.height] = [w, h];
      colours.fit(w, h);
      depths.fit(w, h);
    }
    const range = [Math.max(0.02 * view.far, 0.05), view.far + 3 * data.radius];
    gl.viewport(0, 0, w, h);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(points);
    gl.uniformMatrix4fv(uniform(points, "camera"), false, camera(range));
    gl.uniform3fv(uniform(points, "origin"), data.origin);
    gl.uniform1f(uniform(points, "step"), data.step);
    gl.uniform1f(uniform(points, "size"), data.spacing * h * 1.9);
    gl.uniform2fv(uniform(points, "heights"), data.heights);
    gl.uniform1i(uniform(points, "byTime"), view.byTime);
    gl.uniform3fv(uniform(points, "table"), table(view.byTime ? data.time_colours : data.height_colours));
    gl.uniform1i(uniform(points, "isPath"), 0);
    gl.bindVertexArray(cloud.made);
    gl.drawArrays(gl.POINTS, 0, cloud.n);
    gl.uniform1i(uniform(points, "isPath"), 1);
    gl.bindVertexArray(path.made);
    gl.drawArrays(gl.LINE_STRIP, 0, path.n);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(light);
    [colours, depths].forEach((t, i) => {
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, t.made);
    });
    gl.uniform1i(uniform(light, "colours"), 0);
    gl.uniform1i(uniform(light, "depths"), 1);
    gl.uniform2f(uniform(light, "pixelSize"), 1 / w, 1 / h);
    gl.uniform2fv(uniform(light, "range"), range);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.activeTexture(gl.TEXTURE0);
    draw.count = (draw.count || 0) + 1;
    figure.dataset.drawn = draw.count;
  };
  let asked = 0;
  const redraw = () => { asked = asked || requestAnimationFrame(() => { asked = 0; draw(); }); };

  canvas.addEventListener("pointerdown", (e) => canvas.setPointerCapture(e.pointerId));
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("pointermove", (e) => {
    if (!e.buttons) return;
    if (e.buttons === 1 && !e.shiftKey) {
      view.turn -= 0.008 * e.movementX;
      view.lift = Math.min(Math.max(view.lift + 0.008 * e.movementY, -1.57), 1.57);
    } else {
      const { right, up } = axes(), metres = view.far / (0.95 * canvas.clientHeight);
      view.at = view.at.map((x, i) => x + metres * (up[i] * e.movementY - right[i] * e.movementX));
    }
    redraw();
  });
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    view.far = Math.min(Math.max(view.far * Math.exp(0.0012 * e.deltaY), 0.5), 8 * data.radius);
    redraw();
  }, { passive: false });
  const choices = {
    height: { byTime: false }, time: { byTime: true },
    oblique: { ...oblique, far: 1.5 * data.radius, at: [...data.centre] },
    top: { turn: 0, lift: 1.57, far: 1.5 * data.radius, at: [...data.centre] },
    side: { turn: 0, lift: 0, far: 1.5 * data.radius, at: [...data.centre] },
  };
  for (const button of figure.querySelectorAll("button")) {
    button.addEventListener("click", () => { Object.assign(view, structuredClone(choices[button.value])); redraw(); });
  }
  new ResizeObserver(redraw).observe(canvas);
  redraw();
};

// Drawing takes seconds where there is no graphics card: the page is there first, and what nobody has
// scrolled to costs nothing.
new IntersectionObserver((seen, observer) => {
  if (!seen.some((entry) => entry.isIntersecting)) return;
  observer.disconnect();
  const start = () => setTimeout(startScene, 0, seen[0].target);
  if (document.readyState === "complete") start();
  else window.addEventListener("load", start, { once: true });
}, { rootMargin: "200px" }).observe(document.getElementById("scene"));
