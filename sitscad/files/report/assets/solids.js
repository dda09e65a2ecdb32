// The assembly in 3-D: orbit, parts on and off, section, explode, open, measure. Plain WebGL 2, nothing fetched.
// Lengths are millimetres in the board's axes: x along the tail, y across, z up from the board's top face.
(function (page) {
  "use strict";

  var VERTEX = `#version 300 es
    in vec3 place;
    uniform vec3 low, step, shift;
    uniform mat4 motion, view;
    out vec3 world, seen;
    void main() {
      vec4 at = motion * vec4(low + step * place, 1.0);
      world = at.xyz;
      vec4 shown = view * vec4(at.xyz + shift, 1.0);
      seen = shown.xyz;
      gl_Position = shown;
    }`;
  // Faces are flat: their normal is that of the plane through neighbouring fragments. What a section lays open shows
  // the far walls' back sides, drawn in one tone, so that a cut body looks filled.
  var FRAGMENT = `#version 300 es
    precision highp float;
    in vec3 world, seen;
    uniform vec4 colour, plane;
    uniform vec3 scale; // of the view: right, up, towards the reader
    out vec4 ink;
    void main() {
      if (dot(vec4(world, 1.0), plane) > 0.0) discard;
      vec3 across = dFdx(seen) / scale, along = dFdy(seen) / scale;
      vec3 normal = normalize(cross(across, along));
      float light = gl_FrontFacing ? 0.55 + 0.45 * abs(dot(normal, normalize(vec3(0.35, 0.6, 0.75)))) : 0.8;
      ink = vec4(pow(colour.rgb, vec3(1.0 / 2.2)) * light * colour.a, colour.a);
    }`;

  function bytes(text) {
    var raw = atob(text), found = new Uint8Array(raw.length);
    for (var i = 0; i < raw.length; i++) found[i] = raw.charCodeAt(i);
    return found.buffer;
  }

  function program(gl) {
    var made = gl.createProgram();
    [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]].forEach(function (each) {
      var shader = gl.createShader(each[0]);
      gl.shaderSource(shader, each[1]);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    });
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }

  // A turn by an angle about an axis along y through (x, z), column by column.
  function hinged(pivot, angle) {
    var c = Math.cos(angle), s = Math.sin(angle), x = pivot[0], z = pivot[1];
    return [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, x - c * x - s * z, 0, z + s * x - c * z, 1];
  }
  var STILL = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

  function moved(m, p) {
    return [0, 1, 2].map(function (i) { return m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]; });
  }

  var DEPTH = -0.4; // a body's size takes so much of the depth's -1 to 1, the nearest first
  var VIEWS = {"oblique": [-0.6, 0.45], "top": [0, Math.PI / 2], "side": [0, 0], "tip": [-Math.PI / 2, 0]};

  page.solids = function (root, data, kept) {
    var canvas = root.querySelector("canvas"), gl = canvas.getContext("webgl2", {antialias: true, alpha: true});
    if (!gl) return false;
    var state = kept.solids = kept.solids || {turn: VIEWS.oblique.slice(), zoom: 1, pan: [0, 0], hidden: {}, cut: "none",
      at: 0.5, apart: 0, open: 0};
    var places = new Uint16Array(bytes(data.places)), corners = new Uint16Array(bytes(data.corners));
    var use = program(gl), at = {}, marks = [], measuring = false, asked = false;
    ["low", "step", "shift", "motion", "view", "colour", "plane", "scale"].forEach(function (name) {
      at[name] = gl.getUniformLocation(use, name);
    });
    gl.useProgram(use);
    [[gl.ARRAY_BUFFER, places], [gl.ELEMENT_ARRAY_BUFFER, corners]].forEach(function (each) {
      gl.bindBuffer(each[0], gl.createBuffer());
      gl.bufferData(each[0], each[1], gl.STATIC_DRAW);
    });
    var slot = gl.getAttribLocation(use, "place");
    gl.enableVertexAttribArray(slot);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    var middle = [0, 1, 2].map(function (k) { return (data.box[0][k] + data.box[1][k]) / 2; });
    var size = Math.hypot.apply(null, [0, 1, 2].map(function (k) { return data.box[1][k] - data.box[0][k]; }));
    var heights = data.parts.map(function (part) { return part.low; }).sort(function (a, b) { return a - b; });

    function shift(part) { // of an exploded view: by its rank from below
      return state.apart ? state.apart * 0.009 * size * (heights.indexOf(part.low) - heights.length / 3) : 0;
    }
    function motion(part) {
      return part.opens && data.hinge ? hinged(data.hinge.pivot, state.open * data.hinge.angle) : STILL;
    }
    function plane() {
      var axis = {x: 0, y: 1}[state.cut], cut = [0, 0, 0, -1];
      if (axis === undefined) return cut;
      var low = data.box[0][axis], high = data.box[1][axis];
      cut[axis] = axis === 1 ? -1 : 1; // what is nearer to the usual eye is taken off
      cut[3] = -cut[axis] * (low + state.at * (high - low));
      return cut;
    }
    function axes(turn) { // of the screen in the board's axes: right, up, towards the reader
      var a = (turn || state.turn)[0], b = (turn || state.turn)[1], ca = Math.cos(a), sa = Math.sin(a), cb = Math.cos(b), sb = Math.sin(b);
      return [[ca, sa, 0], [-sa * sb, ca * sb, cb], [sa * cb, -ca * cb, sb]];
    }
    var spans = axes(VIEWS.oblique).map(function (axis) { // width, height and depth of all of it as first seen
      return [0, 1, 2].reduce(function (sum, k) { return sum + Math.abs(axis[k]) * (data.box[1][k] - data.box[0][k]); }, 0);
    });
    function scales() {
      var ratio = canvas.width / canvas.height, one = 1.9 * state.zoom / Math.max(spans[0], spans[1] * ratio);
      return [one, one * ratio];
    }
    function view() {
      var e = axes(), s = scales(), m = new Float32Array(16), rows = [[e[0], s[0]], [e[1], s[1]], [e[2], DEPTH / size]];
      rows.forEach(function (row, i) {
        for (var k = 0; k < 3; k++) m[4 * k + i] = row[0][k] * row[1];
        m[12 + i] = -(row[0][0] * middle[0] + row[0][1] * middle[1] + row[0][2] * middle[2]) * row[1] + (i < 2 ? state.pan[i] : 0);
      });
      m[15] = 1;
      return m;
    }
    function draw() {
      asked = false;
      var ratio = Math.min(window.devicePixelRatio || 1, 2);
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
      canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      var s = scales();
      gl.uniform3fv(at.low, data.box[0]);
      gl.uniform3fv(at.step, data.step);
      gl.uniformMatrix4fv(at.view, false, view());
      gl.uniform4fv(at.plane, plane());
      gl.uniform3f(at.scale, s[0], s[1], DEPTH / size);
      [false, true].forEach(function (clear) { // what is seen through comes last
        gl[clear ? "enable" : "disable"](gl.BLEND);
        gl.depthMask(!clear);
        data.parts.forEach(function (part) {
          if (state.hidden[part.group] || part.alpha < 1 !== clear) return;
          gl.vertexAttribPointer(slot, 3, gl.UNSIGNED_SHORT, false, 6, 6 * part.first);
          gl.uniform4fv(at.colour, part.colour.concat(part.alpha));
          gl.uniform3f(at.shift, 0, 0, shift(part));
          gl.uniformMatrix4fv(at.motion, false, motion(part));
          gl.drawElements(gl.TRIANGLES, part.count, gl.UNSIGNED_SHORT, 2 * part.start);
        });
      });
      gl.depthMask(true);
      dots();
    }
    function redraw() {
      if (!asked) { asked = true; requestAnimationFrame(draw); }
    }

    // Where a point of the board's axes is on the canvas, in parts of it.
    function shown(point) {
      var m = view();
      return [0, 1].map(function (i) {
        var value = m[i] * point[0] + m[4 + i] * point[1] + m[8 + i] * point[2] + m[12 + i];
        return i ? (1 - value) / 2 : (1 + value) / 2;
      });
    }
    function pick(u, v) { // the nearest face under a place of the canvas
      var e = axes(), s = scales(), best = null, cut = plane();
      var x = (2 * u - 1 - state.pan[0]) / s[0], y = (1 - 2 * v - state.pan[1]) / s[1];
      var start = [0, 1, 2].map(function (k) { return middle[k] + x * e[0][k] + y * e[1][k] + 2 * size * e[2][k]; });
      var ray = e[2].map(function (value) { return -value; });
      data.parts.forEach(function (part) {
        if (state.hidden[part.group]) return;
        var lift = shift(part), m = motion(part), known = [];
        function corner(i) {
          if (!known[i]) {
            var k = 3 * (part.first + i);
            known[i] = moved(m, [0, 1, 2].map(function (j) { return data.box[0][j] + data.step[j] * places[k + j]; }));
          }
          return known[i];
        }
        for (var t = part.start; t < part.start + part.count; t += 3) {
          var a = corner(corners[t]), b = corner(corners[t + 1]), c = corner(corners[t + 2]);
          var far = hit(start, ray, a, b, c, lift);
          if (far === null || (best && far >= best.far)) continue;
          var p = [0, 1, 2].map(function (k) { return start[k] + far * ray[k]; });
          if (p[0] * cut[0] + p[1] * cut[1] + (p[2] - lift) * cut[2] + cut[3] > 0) continue;
          best = {far: far, at: p, own: [p[0], p[1], p[2] - lift], part: part.name, lift: lift};
        }
      });
      return best;
    }
    function hit(start, ray, a, b, c, lift) { // Moeller and Trumbore, Journal of Graphics Tools 2 (1997)
      var u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
      var p = cross(ray, v), det = dot(u, p);
      if (Math.abs(det) < 1e-12) return null;
      var away = [start[0] - a[0], start[1] - a[1], start[2] - a[2] - lift], s = dot(away, p) / det;
      if (s < 0 || s > 1) return null;
      var q = cross(away, u), r = dot(ray, q) / det;
      return r < 0 || s + r > 1 ? null : dot(v, q) / det;
    }
    function cross(a, b) {
      return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    }
    function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

    var layer = root.querySelector(".marks"), said = root.querySelector("[data-out=measured]");
    function dots() {
      layer.innerHTML = "";
      marks.forEach(function (mark, k) {
        var on = shown(mark.at), dot = document.createElement("i");
        dot.style.left = 100 * on[0] + "%";
        dot.style.top = 100 * on[1] + "%";
        dot.textContent = k + 1;
        layer.appendChild(dot);
      });
    }
    function mark(u, v) {
      var found = pick(u, v);
      if (!found) { said.textContent = "nothing there"; return; }
      if (marks.length === 2) marks = [];
      marks.push(found);
      var words = marks.map(function (m) {
        return m.part + " (" + m.own.map(function (value) { return value.toFixed(3); }).join(", ") + ")";
      });
      if (marks.length === 2) {
        var d = [0, 1, 2].map(function (k) { return marks[1].own[k] - marks[0].own[k]; });
        words.push(Math.hypot(d[0], d[1], d[2]).toFixed(3) + " mm apart: x " + d[0].toFixed(3) + ", y " + d[1].toFixed(3) + ", z " + d[2].toFixed(3));
      }
      said.textContent = words.join("; ");
      redraw();
    }

    var held = null;
    canvas.addEventListener("pointerdown", function (event) {
      held = {x: event.clientX, y: event.clientY, far: 0, pan: event.shiftKey || event.button === 1 || event.button === 2};
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", function (event) {
      if (!held) return;
      var dx = event.clientX - held.x, dy = event.clientY - held.y;
      held.x = event.clientX;
      held.y = event.clientY;
      held.far += Math.abs(dx) + Math.abs(dy);
      if (held.pan) pan(2 * dx / canvas.clientWidth, -2 * dy / canvas.clientHeight);
      else turn(-0.008 * dx, 0.008 * dy);
    });
    canvas.addEventListener("pointerup", function (event) {
      if (held && held.far < 4 && measuring) {
        var box = canvas.getBoundingClientRect();
        mark((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
      }
      held = null;
    });
    canvas.addEventListener("contextmenu", function (event) { event.preventDefault(); });
    canvas.addEventListener("wheel", function (event) {
      if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls until the view is chosen
      event.preventDefault();
      zoom(Math.exp(-0.0015 * event.deltaY));
    }, {passive: false});
    canvas.addEventListener("keydown", function (event) {
      var by = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
      if (by && event.shiftKey) pan(-by[0], by[1]);
      else if (by) turn(by[0], by[1]);
      else if (event.key === "+" || event.key === "=") zoom(1.2);
      else if (event.key === "-") zoom(1 / 1.2);
      else if (event.key === "m") mark(0.5, 0.5);
      else return;
      event.preventDefault();
    });
    function turn(a, b) {
      state.turn = [state.turn[0] + a, Math.max(-Math.PI / 2, Math.min(Math.PI / 2, state.turn[1] + b))];
      redraw();
    }
    function pan(x, y) { state.pan = [state.pan[0] + x, state.pan[1] + y]; redraw(); }
    function zoom(by) { state.zoom = Math.max(0.3, Math.min(60, state.zoom * by)); redraw(); }

    var groups = data.parts.map(function (part) { return part.group; });
    groups = groups.filter(function (name, k) { return groups.indexOf(name) === k; });
    var list = root.querySelector(".parts");
    list.innerHTML = "<legend>parts</legend>";
    groups.forEach(function (name) {
      list.appendChild(page.check(name, !state.hidden[name], function (on) { state.hidden[name] = !on; redraw(); }));
    });
    var views = root.querySelector(".views");
    views.innerHTML = "";
    Object.keys(VIEWS).forEach(function (name) {
      views.appendChild(page.button(name, function () {
        state.turn = VIEWS[name].slice();
        state.pan = [0, 0];
        state.zoom = 1;
        redraw();
      }));
    });
    views.appendChild(page.button("nearer", function () { zoom(1.4); }));
    views.appendChild(page.button("farther", function () { zoom(1 / 1.4); }));
    root.querySelector("[data-in=cut]").value = state.cut;
    [["cut", function (value) { state.cut = value; }], ["at", function (value) { state.at = +value; }],
      ["apart", function (value) { state.apart = +value; }], ["open", function (value) { state.open = +value; }]
    ].forEach(function (each) {
      var input = root.querySelector("[data-in=" + each[0] + "]");
      if (!input) return;
      if (input.type === "range") input.value = state[each[0]];
      input.addEventListener("input", function () { each[1](input.value); redraw(); });
    });
    var ruler = root.querySelector("[data-in=measure]");
    ruler.addEventListener("click", function () {
      measuring = !measuring;
      marks = [];
      ruler.setAttribute("aria-pressed", measuring);
      said.textContent = measuring ? "click two points, or press m to take the one in the middle" : "";
      redraw();
    });
    new ResizeObserver(redraw).observe(canvas);
    page.pushed3d = function () { redraw(); };
    draw();
    return true;
  };
})(window.sitscad = window.sitscad || {});
