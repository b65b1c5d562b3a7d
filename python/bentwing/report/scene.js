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
    `uniform mat4 camera; uniform vec3 origin, low, high; uniform float step, size; uniform vec2 heights;
     uniform bool byHeight, isPath; uniform vec3 table[9];
     in vec3 place; in float value; out vec3 colour;
     vec3 shade(float x) {
       float at = clamp(x, 0.0, 1.0) * 8.0; int i = min(int(at), 7);
       return mix(table[i], table[i + 1], at - float(i));
     }
     void main() {
       vec3 p = origin + place * step;
       bool isCut = !isPath && (any(lessThan(p, low)) || any(greaterThan(p, high)));
       gl_Position = isCut ? vec4(9.0, 9.0, 9.0, 1.0) : camera * vec4(p, 1.0);
       gl_PointSize = clamp(size, 1.5, 9.0);
       float x = byHeight ? (p.z - heights.x) / max(heights.y - heights.x, 1e-6) : value / 254.0;
       bool isUnknown = !byHeight && value > 254.5;
       colour = isPath ? mix(vec3(0.12, 0.16, 0.2), vec3(0.78, 0.25, 0.18), value) : isUnknown ? vec3(0.7) : shade(x);
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
    `uniform sampler2D colours, depths; uniform vec2 pixelSize; uniform float depthInPixels; in vec2 at; out vec4 pixel;
     void main() {
       float here = texture(depths, at).r, hidden = 0.0;
       if (here >= 1.0) { pixel = vec4(1.0); return; }
       for (int k = 0; k < 8; k++) {
         float a = 0.7854 * float(k);
         float there = texture(depths, at + 1.5 * pixelSize * vec2(cos(a), sin(a))).r;
         hidden += clamp((here - there) * depthInPixels / 1.5, 0.0, 4.0);
       }
       pixel = vec4(texture(colours, at).rgb * (0.3 + 0.7 * exp(-hidden / 10.0)), 1.0);
     }`);

  const buffer = (places, values) => {
    const made = gl.createVertexArray();
    gl.bindVertexArray(made);
    let last = null; // the buffer of the values, which change with the colour
    for (const [name, n, kind, array] of [["place", 3, gl.UNSIGNED_SHORT, places], ["value", 1, gl.UNSIGNED_BYTE, values]]) {
      last = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, last);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
      const at = gl.getAttribLocation(points, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, n, kind, false, 0, 0);
    }
    return { made, n: values.length, values: last };
  };
  const codes = Object.fromEntries(data.colours.map((c) => [c.name, c.codes && bytes(c.codes)]));
  const cloud = buffer(bytes(data.points), codes.time);
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

  const places = new Uint16Array(bytes(data.points).buffer);
  const size = data.high.map((x, i) => x - data.low[i]);
  const oblique = { turn: -0.5, lift: 0.6 };
  const view = { ...oblique, at: [...data.centre], scale: 1, colour: data.colours[0], low: [...data.low], high: [...data.high] };
  view.high[2] = data.cut;

  // All views are orthographic, so that the scale bar is true everywhere.
  const axes = () => {
    const [ct, st, cl, sl] = [Math.cos(view.turn), Math.sin(view.turn), Math.cos(view.lift), Math.sin(view.lift)];
    return { right: [ct, st, 0], up: [-st * sl, ct * sl, cl], toward: [st * cl, -ct * cl, sl] };
  };
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const fit = () => { // scale in CSS pixels per metre at which the whole map is seen
    const { right, up } = axes();
    const reach = (axis) => axis.reduce((sum, x, i) => sum + Math.abs(x) * size[i], 0);
    view.scale = 0.92 * Math.min(canvas.clientWidth / reach(right), canvas.clientHeight / reach(up));
    view.at = [...data.centre];
  };
  const depth = () => 2 * data.radius + Math.hypot(...view.at.map((x, i) => x - data.centre[i]));
  const camera = () => { // from map to clip coordinates; column-major
    const { right, up, toward } = axes();
    const row = (axis, factor) => [...axis.map((x) => x * factor), -dot(axis, view.at) * factor];
    const rows = [row(right, 2 * view.scale / canvas.clientWidth), row(up, 2 * view.scale / canvas.clientHeight),
      row(toward, -1 / depth()), [0, 0, 0, 1]];
    return [0, 1, 2, 3].flatMap((i) => rows.map((r) => r[i]));
  };
  const onScreen = (p) => { // CSS pixels from the upper left, and metres towards the viewer
    const { right, up, toward } = axes(), q = p.map((x, i) => x - view.at[i]);
    return [canvas.clientWidth / 2 + view.scale * dot(right, q), canvas.clientHeight / 2 - view.scale * dot(up, q), dot(toward, q)];
  };

  const uniform = (which, name) => gl.getUniformLocation(which, name);
  const table = (codes) => codes.flatMap((c) => [0, 2, 4].map((i) => parseInt(c.slice(i, i + 2), 16) / 255));
  const draw = () => {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (!w || !h) return;
    if (canvas.width !== w || canvas.height !== h || !draw.count) {
      [canvas.width, canvas.height] = [w, h];
      colours.fit(w, h);
      depths.fit(w, h);
      if (!view.isMoved) fit();
    }
    gl.viewport(0, 0, w, h);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(points);
    gl.uniformMatrix4fv(uniform(points, "camera"), false, camera());
    gl.uniform3fv(uniform(points, "origin"), data.origin);
    gl.uniform3fv(uniform(points, "low"), view.low);
    gl.uniform3fv(uniform(points, "high"), view.high);
    gl.uniform1f(uniform(points, "step"), data.step);
    gl.uniform1f(uniform(points, "size"), data.spacing * view.scale * ratio);
    gl.uniform2fv(uniform(points, "heights"), data.colours[0].range);
    gl.uniform1i(uniform(points, "byHeight"), !view.colour.codes);
    gl.uniform3fv(uniform(points, "table"), table(view.colour.table));
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
    gl.uniform1f(uniform(light, "depthInPixels"), 2 * depth() * view.scale * ratio);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.activeTexture(gl.TEXTURE0);
    drawScale();
    drawMeasure();
    draw.count = (draw.count || 0) + 1;
    figure.dataset.drawn = draw.count;
  };
  let asked = 0;
  const redraw = () => { asked = asked || requestAnimationFrame(() => { asked = 0; draw(); }); };

  const number = (x, digits) => x.toFixed(digits).replace(".", data.decimal).replace("-", "\u2212");
  const part = (name) => figure.querySelector(`[data-part="${name}"]`);
  const drawScale = () => {
    const longest = canvas.clientWidth / 4 / view.scale, magnitude = 10 ** Math.floor(Math.log10(longest));
    const metres = [5, 2, 1].map((m) => m * magnitude).find((m) => m <= longest);
    part("bar").style.width = `${metres * view.scale}px`;
    part("length").textContent = metres >= 1 ? `${metres} m` : `${Math.round(1000 * metres)} mm`;
    const { table, range: [low, high], isPart } = view.colour;
    const legend = isPart ? `${view.colour.legend}; ${data.words.unknown}` : view.colour.legend;
    part("colours").style.background = `linear-gradient(to right, ${table.map((c) => "#" + c).join(",")})`;
    [part("what").textContent, part("lowest").textContent, part("highest").textContent] = [legend, number(low, 1), number(high, 1)];
  };

  // A distance between two points of the map that are picked.
  const picked = [], taken = []; // the ends of the distance, and all that was clicked
  const isShown = (p) => p.every((x, i) => x >= view.low[i] && x <= view.high[i]);
  const pick = (x, y) => { // the nearest to the viewer of those within some pixels, else none
    const near = 6;
    let best = null, nearest = -Infinity;
    for (let k = 0; k < places.length; k += 3) {
      const p = [0, 1, 2].map((i) => data.origin[i] + data.step * places[k + i]);
      const [a, b, toward] = onScreen(p);
      if (toward > nearest && Math.hypot(a - x, b - y) < near && isShown(p)) [best, nearest] = [Object.assign(p, { at: k / 3 }), toward];
    }
    return best;
  };
  const take = (x, y) => {
    const found = view.isMeasuring && pick(x, y);
    if (!found) return;
    if (picked.length === 2) picked.length = 0;
    picked.push(found);
    taken.push(found);
    redraw();
  };
  const inMap = (p) => { // in the frame of the trajectory
    const { R, place, middle } = data.to_map, gap = p.map((x, i) => x - place[i]);
    return R.map((row, i) => (dot(row, gap) + middle[i]).toFixed(4));
  };
  const [first, last] = data.colours.find((c) => c.name === "time").range;
  const seconds = (p) => (first + (last - first) * codes.time[p.at] / 254).toFixed(1);
  const contents = {
    points: () => ["points.csv", "id,x,y,z,map_x,map_y,map_z\n" + taken.map((p, i) => `P${i + 1},,,,${inMap(p)}\n`).join("")],
    loop: () => ["loops.yaml", `loops:\n- times: [${taken.slice(-2).map(seconds).join(", ")}]\n`],
  };
  const save = (what) => {
    if (taken.length < (what === "loop" ? 2 : 1)) { part("distance").textContent = data.words.none; return; }
    const [name, text] = contents[what](), link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
    link.download = name;
    link.click();
    URL.revokeObjectURL(link.href);
  };
  const drawMeasure = () => {
    const overlay = part("measured"), at = picked.map(onScreen);
    overlay.innerHTML = at.map(([x, y]) => `<circle cx="${x}" cy="${y}" r="5"/>`).join("")
      + (at.length === 2 ? `<line x1="${at[0][0]}" y1="${at[0][1]}" x2="${at[1][0]}" y2="${at[1][1]}"/>` : "");
    const told = part("distance");
    if (!view.isMeasuring) told.textContent = "";
    else if (picked.length < 2) told.textContent = data.words[picked.length ? "second" : "first"];
    else {
      const gap = picked[1].map((x, i) => x - picked[0][i]);
      const [level, whole] = [Math.hypot(gap[0], gap[1]), Math.hypot(...gap)].map((x) => number(x, 3));
      told.textContent = data.words.apart.replace("{whole}", whole).replace("{level}", level).replace("{up}", number(gap[2], 3));
    }
  };

  const turnBy = (x, y) => {
    view.turn -= 0.008 * x;
    view.lift = Math.min(Math.max(view.lift + 0.008 * y, -Math.PI / 2), Math.PI / 2);
  };
  const shiftBy = (x, y) => {
    const { right, up } = axes();
    view.at = view.at.map((c, i) => c + (up[i] * y - right[i] * x) / view.scale);
    view.isMoved = true;
  };
  const zoomBy = (factor) => {
    view.scale = Math.min(Math.max(view.scale * factor, 20 / data.radius), 5000);
    view.isMoved = true;
  };

  // The page scrolls past the view until that is clicked, and again once something else is.
  const setActive = (isActive) => {
    figure.classList.toggle("active", isActive);
    canvas.style.touchAction = isActive ? "none" : "pan-y";
  };
  document.addEventListener("pointerdown", (e) => { if (!figure.contains(e.target)) setActive(false); });
  const fingers = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    moved = 0;
  });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const [x, y] = [e.clientX - before[0], e.clientY - before[1]];
    moved += Math.hypot(x, y);
    const other = [...fingers].find(([id]) => id !== e.pointerId);
    if (other) { // two fingers shift and zoom
      const far = (p) => Math.max(Math.hypot(p[0] - other[1][0], p[1] - other[1][1]), 1);
      zoomBy(far([e.clientX, e.clientY]) / far(before));
      shiftBy(x / 2, y / 2);
    } else if (e.buttons === 1 && !e.shiftKey) turnBy(x, y);
    else shiftBy(x, y);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    redraw();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("click", (e) => {
    setActive(true);
    const box = canvas.getBoundingClientRect();
    if (moved <= 4) take(e.clientX - box.left, e.clientY - box.top);
  });
  canvas.addEventListener("wheel", (e) => {
    if (!figure.classList.contains("active") && !e.ctrlKey) return;
    e.preventDefault();
    zoomBy(Math.exp(-0.0012 * e.deltaY));
    redraw();
  }, { passive: false });
  const steps = { ArrowLeft: [-24, 0], ArrowRight: [24, 0], ArrowUp: [0, -24], ArrowDown: [0, 24] };
  canvas.addEventListener("keydown", (e) => {
    if (steps[e.key]) (e.shiftKey ? shiftBy : turnBy)(...steps[e.key]);
    else if (e.key === "+" || e.key === "=") zoomBy(1.2);
    else if (e.key === "-") zoomBy(1 / 1.2);
    else if (e.key === "Enter") take(canvas.clientWidth / 2, canvas.clientHeight / 2);
    else if (e.key === "Escape") { picked.length = taken.length = 0; setActive(false); }
    else return;
    e.preventDefault();
    redraw();
  });

  const looks = { oblique, top: { turn: 0, lift: Math.PI / 2 }, front: { turn: 0, lift: 0 }, side: { turn: Math.PI / 2, lift: 0 } };
  const paint = (name) => {
    view.colour = data.colours.find((c) => c.name === name);
    for (const { name: other } of data.colours) figure.querySelector(`button[value=${other}]`).ariaPressed = other === name;
    if (!codes[name]) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, cloud.values);
    gl.bufferData(gl.ARRAY_BUFFER, codes[name], gl.STATIC_DRAW);
  };
  const press = (button) => {
    const { value } = button;
    if (contents[value]) { save(value); return; }
    if (looks[value]) { Object.assign(view, looks[value], { isMoved: false }); fit(); }
    else if (value === "measure") { view.isMeasuring = !view.isMeasuring; picked.length = 0; button.ariaPressed = view.isMeasuring; }
    else paint(value);
    redraw();
  };
  for (const button of figure.querySelectorAll("button")) button.addEventListener("click", () => press(button));
  for (const slider of figure.querySelectorAll("input[type=range]")) { // one side of the clip box
    const side = slider.dataset.side, axis = Number(slider.dataset.axis), told = slider.nextElementSibling;
    const tell = () => { told.textContent = `${number(view[side][axis] + data.shown[axis], 2)} m`; };
    [slider.min, slider.max, slider.step] = [data.low[axis], data.high[axis], "any"];
    slider.value = view[side][axis];
    slider.addEventListener("input", () => { view[side][axis] = Number(slider.value); tell(); redraw(); });
    tell();
  }
  paint(view.colour.name);
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
