"use strict";
// Draws the scene of a page: meshes that move along tracks, and contacts. No library, no network.
(() => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const byId = (name) => document.getElementById(name);
  const canvas = document.querySelector("#stage canvas"), labels = byId("labels"), scrub = byId("scrub");
  const gl = canvas.getContext("webgl", { antialias: true, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });

  // --- small mathematics: vectors are arrays, matrices are column by column -------------------------------------
  const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
  const times = (a, b) => {
    const m = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
      for (let k = 0; k < 4; k++) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
    return m;
  };
  const posed = (p, q) => { // place and quaternion (w, x, y, z)
    const [w, x, y, z] = q;
    return new Float32Array([
      1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
      2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
      2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0, p[0], p[1], p[2], 1]);
  };
  const pointing = (p, towards, s) => { // the z axis along a direction, scaled
    const z = unit(towards), x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z)), y = cross(z, x);
    return new Float32Array([...x.map((v) => v * s), 0, ...y.map((v) => v * s), 0, ...z.map((v) => v * s), 0, ...p, 1]);
  };
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const color = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);

  // --- meshes: corners with normals that are smooth up to a crease ----------------------------------------------
  const CREASE = Math.cos(0.6);
  function shaded(vertices, triangles) {
    const count = triangles.length / 3, normals = [], areas = [], around = new Map();
    const corner = (k) => [vertices[3 * k], vertices[3 * k + 1], vertices[3 * k + 2]];
    for (let t = 0; t < count; t++) {
      const [a, b, c] = [0, 1, 2].map((i) => corner(triangles[3 * t + i]));
      const n = cross(sub(b, a), sub(c, a));
      areas.push(n);
      normals.push(unit(n));
      for (let i = 0; i < 3; i++) {
        const v = triangles[3 * t + i];
        if (!around.has(v)) around.set(v, []);
        around.get(v).push(t);
      }
    }
    const out = new Float32Array(18 * count);
    for (let t = 0; t < count; t++) for (let i = 0; i < 3; i++) {
      const v = triangles[3 * t + i];
      let n = [0, 0, 0];
      for (const other of around.get(v)) if (dot(normals[other], normals[t]) > CREASE) n = along(n, 1, areas[other]);
      out.set(corner(v), 18 * t + 6 * i);
      out.set(unit(n), 18 * t + 6 * i + 3);
    }
    return out;
  }
  function decoded(solid) {
    const raw = new Uint16Array(bytes(solid.vertices)), vertices = new Float32Array(raw.length);
    for (let i = 0; i < raw.length; i++) vertices[i] = solid.low[i % 3] + raw[i] * solid.step[i % 3];
    const indices = bytes(solid.triangles);
    return shaded(vertices, solid.wide ? new Uint32Array(indices) : new Uint16Array(indices));
  }
  function turned(profile) { // a surface of revolution about z from points (radius, height)
    const vertices = [], triangles = [], n = 20;
    profile.forEach(([r, z]) => { for (let k = 0; k < n; k++) vertices.push(r * Math.cos(2 * Math.PI * k / n), r * Math.sin(2 * Math.PI * k / n), z); });
    for (let i = 0; i + 1 < profile.length; i++) for (let k = 0; k < n; k++) {
      const a = i * n + k, b = i * n + (k + 1) % n;
      triangles.push(a, b, b + n, a, b + n, a + n);
    }
    return shaded(vertices, triangles);
  }
  const buffered = (data) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return { buffer, count: data.length / 6 };
  };

  // --- what is shown --------------------------------------------------------------------------------------------
  const grasps = scene.grasps.map((grasp) => ({
    ...grasp, tracks: grasp.tracks.map((track) => new Float32Array(bytes(track))),
    groups: grouped(grasp.contacts),
  }));
  function grouped(contacts) { // contacts at one place share a label
    const groups = [];
    contacts.forEach((c, k) => {
      const near = groups.find((g) => Math.hypot(...sub(g.at, c.position)) < 1.5e-3);
      if (near) near.numbers.push(k + 1); else groups.push({ at: c.position, normal: c.normal, numbers: [k + 1] });
    });
    return groups;
  }
  let shown = 0, moment = 1, playing = false, before = 0, due = true, marked = -1;
  const view = { target: [0, 0, 0], distance: 1, azimuth: 0, height: 0.4, size: 0.2 };
  const grasp = () => grasps[shown];
  function poses(each, share) {
    return each.tracks.map((track) => {
      const last = track.length / 7 - 1, at = share * last, i = Math.min(Math.floor(at), Math.max(last - 1, 0)), s = at - i;
      const a = track.subarray(7 * i, 7 * i + 7), b = last ? track.subarray(7 * i + 7, 7 * i + 14) : a;
      const mix = Array.from(a, (v, k) => v + s * (b[k] - v)), n = Math.hypot(...mix.slice(3));
      return posed(mix.slice(0, 3), mix.slice(3).map((v) => v / n));
    });
  }
  function fit() {
    const { middle, radius, towards } = grasp().view;
    view.target = middle.slice();
    view.size = radius;
    view.azimuth = Math.atan2(towards[1], towards[0]);
    view.height = Math.asin(Math.max(-1, Math.min(1, towards[2])));
    const wide = Math.min(1, (canvas.clientWidth || 4) / (canvas.clientHeight || 3));
    view.distance = 1.04 * radius / Math.sin(FIELD / 2) / wide;
    due = true;
  }

  // --- drawing --------------------------------------------------------------------------------------------------
  const FIELD = 0.5; // of view [rad]
  let program, place, solids, ball, arrow;
  function prepare() {
    const shader = (kind, text) => { const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); return s; };
    program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, `
      attribute vec3 corner, normal; uniform mat4 model, camera; varying vec3 n, at;
      void main() { vec4 w = model * vec4(corner, 1.0); n = mat3(model) * normal; at = w.xyz; gl_Position = camera * w; }`));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
      precision highp float; uniform vec4 paint; uniform vec3 eye, key; uniform float shine; varying vec3 n, at;
      void main() {
        vec3 v = normalize(eye - at), m = normalize(n); if (dot(m, v) < 0.0) m = -m;
        float light = 0.50 + 0.10 * m.z + 0.40 * max(dot(m, key), 0.0) + 0.12 * max(dot(m, v), 0.0);
        float glint = shine * pow(max(dot(m, normalize(key + v)), 0.0), 24.0);
        vec3 c = clip(paint.rgb * light + glint); gl_FragColor = vec4(c * paint.a, paint.a);
      }`.replace("clip(paint.rgb * light + glint)", "min(paint.rgb * light + glint, vec3(1.0))")));
    gl.linkProgram(program);
    gl.useProgram(program);
    place = Object.fromEntries(["model", "camera", "paint", "eye", "key", "shine"].map((u) => [u, gl.getUniformLocation(program, u)]));
    place.corner = gl.getAttribLocation(program, "corner");
    place.normal = gl.getAttribLocation(program, "normal");
    solids = scene.solids.map((solid) => ({ ...buffered(decoded(solid)), kind: solid.kind, paint: color(solid.color) }));
    const round = Array.from({ length: 11 }, (_, k) => [Math.sin(Math.PI * k / 10), -Math.cos(Math.PI * k / 10)]);
    ball = buffered(turned(round));
    arrow = buffered(turned([[0, 0], [0.055, 0], [0.055, 0.7], [0.16, 0.7], [0, 1]]));
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }
  function eyeOf() {
    const level = Math.cos(view.height);
    return [level * Math.cos(view.azimuth), level * Math.sin(view.azimuth), Math.sin(view.height)];
  }
  function cameraOf(width, height) {
    const back = eyeOf(), right = unit(cross([0, 0, 1], back)), up = cross(back, right), eye = along(view.target, view.distance, back);
    const near = Math.max(view.distance - 8 * view.size, 0.02 * view.distance), far = view.distance + 40 * view.size;
    const f = 1 / Math.tan(FIELD / 2), d = near - far;
    const look = new Float32Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, -dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
    const lens = new Float32Array([f * height / width, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / d, -1, 0, 0, 2 * near * far / d, 0]);
    return { matrix: times(lens, look), eye, back, right, up };
  }
  function put(mesh, model, paint, alpha, shine) {
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffer);
    gl.vertexAttribPointer(place.corner, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(place.normal, 3, gl.FLOAT, false, 24, 12);
    gl.enableVertexAttribArray(place.corner);
    gl.enableVertexAttribArray(place.normal);
    gl.uniformMatrix4fv(place.model, false, model);
    gl.uniform4f(place.paint, ...paint, alpha);
    gl.uniform1f(place.shine, shine);
    gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  }
  function draw(each, share, width, height) {
    const camera = cameraOf(width, height), where = poses(each, share), solid = byId("opacity").value / 100;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(place.camera, false, camera.matrix);
    gl.uniform3f(place.eye, ...camera.eye);
    gl.uniform3f(place.key, ...unit(along(along(camera.back, -0.5, camera.right), 0.9, camera.up)));
    gl.disable(gl.BLEND);
    gl.enable(gl.POLYGON_OFFSET_FILL); // surfaces of two links that coincide do not flicker
    solids.forEach((s, k) => {
      gl.polygonOffset(0, -8 * (k % 7));
      if (s.kind === "forearm" ? byId("forearm").checked : s.kind !== "object") put(s, where[k], s.paint, 1, s.kind === "obstacle" ? 0 : 0.16);
    });
    gl.disable(gl.POLYGON_OFFSET_FILL);
    if (byId("marks").checked) marks(each, share);
    gl.enable(gl.BLEND);
    gl.enable(gl.CULL_FACE);
    for (const side of [gl.FRONT, gl.BACK]) { // what is far first
      gl.cullFace(side);
      solids.forEach((s, k) => { if (s.kind === "object") put(s, where[k], s.paint, solid, 0.08); });
    }
    gl.disable(gl.CULL_FACE);
    return camera;
  }
  function marks(each, share) {
    const size = 0.02 * view.size, near = share > 0.995;
    for (const through of [true, false]) { // faint where something is before them
      gl[through ? "disable" : "enable"](gl.DEPTH_TEST);
      gl[through ? "enable" : "disable"](gl.BLEND);
      each.groups.forEach((g) => {
        const paint = g.numbers.includes(marked + 1) ? [0.04, 0.38, 0.64] : near ? [0.86, 0.37, 0] : [0.6, 0.6, 0.6];
        put(ball, pointing(g.at, [0, 0, 1], size), paint, through ? 0.4 : 1, 0.2);
        put(arrow, pointing(g.at, g.normal, 7 * size), paint, through ? 0.3 : 1, 0.2);
      });
    }
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
  }
  function number(camera, width, height) { // labels beside their contacts, away from the middle
    labels.textContent = "";
    if (!byId("numbers").checked || !byId("marks").checked || moment < 0.995) return;
    const m = camera.matrix, seen = grasp().groups.map((g) => {
      const tip = along(g.at, 0.2 * view.size, g.normal), c = [0, 1, 3].map((r) => m[r] * tip[0] + m[4 + r] * tip[1] + m[8 + r] * tip[2] + m[12 + r]);
      return { x: (0.5 + 0.5 * c[0] / c[2]) * width, y: (0.5 - 0.5 * c[1] / c[2]) * height, numbers: g.numbers };
    });
    for (let round = 0; round < 40; round++) seen.forEach((a) => seen.forEach((b) => {
      const wide = 9 + 5 * (a.numbers.length + b.numbers.length), x = a.x - b.x, y = a.y - b.y || 0.1;
      if (a !== b && Math.abs(x) < wide && Math.abs(y) < 18) a.y += Math.sign(y) * 1.5;
    }));
    for (const { x, y, numbers } of seen) {
      const label = labels.appendChild(document.createElement("span"));
      label.textContent = numbers.join(", ");
      label.style.left = `${x}px`;
      label.style.top = `${y}px`;
      label.classList.toggle("marked", numbers.includes(marked + 1));
    }
  }
  function frame(now) {
    requestAnimationFrame(frame);
    if (playing) {
      moment += (now - before) / 1000 * byId("speed").value / grasp().duration;
      if (moment >= 1) { moment = 1; playing = false; }
      scrub.value = 1000 * moment;
      due = true;
    }
    before = now;
    const ratio = 2, // smooth edges, on any screen
       width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; due = true; }
    if (!due || !width || !height) return;
    due = false;
    byId("play").textContent = playing ? "Pause" : "Play";
    byId("time").textContent = grasp().duration ? `${(moment * grasp().duration).toFixed(2)} s` : "";
    number(draw(grasp(), moment, width, height), canvas.clientWidth, canvas.clientHeight);
  }

  // --- hands on -------------------------------------------------------------------------------------------------
  function choose(k) {
    shown = k;
    moment = 1;
    scrub.value = 1000;
    marked = -1;
    document.querySelectorAll("#facts article").forEach((a, i) => { a.hidden = i !== k; });
    document.querySelectorAll("#strip button").forEach((b, i) => b.setAttribute("aria-pressed", String(i === k)));
    fit();
  }
  function strip() {
    if (grasps.length < 2) return;
    byId("strip").hidden = false;
    canvas.width = 232;
    canvas.height = 172;
    grasps.forEach((each, k) => {
      const button = byId("strip").appendChild(document.createElement("button"));
      button.type = "button";
      button.addEventListener("click", () => choose(k));
      const small = button.appendChild(document.createElement("canvas"));
      small.width = 232;
      small.height = 172;
      button.appendChild(document.createElement("span")).textContent = `${k + 1}  ${each.label}`;
      button.appendChild(document.createElement("small")).textContent = each.caption;
      if (!gl) return;
      shown = k;
      fit();
      view.distance *= 1.0 / Math.min(1, 232 / 172);
      draw(each, 1, 232, 172);
      small.getContext("2d").drawImage(canvas, 0, 0);
    });
  }
  function play() {
    if (!playing && moment >= 1) moment = 0;
    playing = !playing && grasp().duration > 0;
    due = true;
  }
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (e) => { byId("note").hidden = true; canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, e); });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("pointermove", (e) => {
    const last = fingers.get(e.pointerId);
    if (!last) return;
    const dx = e.clientX - last.clientX, dy = e.clientY - last.clientY, others = [...fingers.values()].filter((f) => f.pointerId !== e.pointerId);
    const shift = others.length || e.buttons & 2 || e.shiftKey;
    if (others.length) {
      const gap = (p) => Math.hypot(p.clientX - others[0].clientX, p.clientY - others[0].clientY) || 1;
      view.distance *= gap(last) / gap(e);
    }
    if (shift) {
      const { right, up } = cameraOf(canvas.width, canvas.height), step = 2 * view.distance * Math.tan(FIELD / 2) / canvas.clientHeight / (others.length ? 2 : 1);
      view.target = along(along(view.target, -dx * step, right), dy * step, up);
    } else {
      view.azimuth -= 0.008 * dx;
      view.height = Math.max(-1.5, Math.min(1.5, view.height + 0.008 * dy));
    }
    fingers.set(e.pointerId, e);
    due = true;
  });
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); view.distance *= Math.exp(0.0012 * e.deltaY); due = true; }, { passive: false });
  canvas.addEventListener("dblclick", fit);
  byId("play").addEventListener("click", play);
  scrub.addEventListener("input", () => { moment = scrub.value / 1000; playing = false; due = true; });
  for (const name of ["opacity", "marks", "numbers", "forearm"]) byId(name).addEventListener("input", () => { due = true; });
  byId("theme").addEventListener("click", () => {
    const root = document.documentElement, dark = matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = (root.dataset.theme || (dark ? "dark" : "light")) === "dark" ? "light" : "dark";
  });
  document.addEventListener("keydown", (e) => {
    if (/^(INPUT|SELECT|BUTTON|SUMMARY)$/.test(e.target.tagName)) return;
    if (e.key === " ") { e.preventDefault(); play(); }
    const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    if (step && grasps.length > 1) choose((shown + step + grasps.length) % grasps.length);
  });
  document.querySelectorAll("tr[data-contact]").forEach((row) => {
    const mark = (on) => () => {
      marked = on ? Number(row.dataset.contact) : -1;
      row.classList.toggle("marked", on);
      due = true;
    };
    row.addEventListener("pointerenter", mark(true));
    row.addEventListener("pointerleave", mark(false));
  });
  if (gl) {
    prepare();
    canvas.addEventListener("webglcontextlost", (e) => e.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { prepare(); due = true; });
  } else {
    byId("note").textContent = "This browser draws no WebGL; the numbers are complete.";
  }
  const has = (kind) => scene.solids.some((s) => s.kind === kind);
  byId("forearm").parentElement.hidden = !has("forearm");
  byId("opacity").parentElement.hidden = !has("object");
  for (const name of ["marks", "numbers"]) byId(name).parentElement.hidden = !grasps.some((g) => g.contacts.length);
  strip();
  choose(0);
  if (gl) requestAnimationFrame(frame);
})();
