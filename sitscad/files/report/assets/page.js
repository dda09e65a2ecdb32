// What binds the page together: findings and drawing point at each other, the board's layers and nets go on and off,
// the 3-D view and the pushed sensor begin where their data is. Without scripts all of it is there as text and pictures.
(function (page) {
  "use strict";

  page.button = function (words, act) {
    var made = document.createElement("button");
    made.type = "button";
    made.textContent = words;
    made.addEventListener("click", act);
    return made;
  };
  page.check = function (words, on, act) {
    var label = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.checked = on;
    box.addEventListener("change", function () { act(box.checked); });
    label.append(box, " " + words);
    return label;
  };

  var kept = page.kept = page.kept || {}; // camera, layers, loads: what stays when a part of the page is made anew

  function data(id) {
    var holds = document.getElementById(id);
    return holds ? JSON.parse(holds.textContent) : null;
  }

  function board(figure) {
    var picture = figure.querySelector("svg svg") || figure.querySelector("svg");
    var bar = document.createElement("div"), said = document.createElement("output");
    var state = kept.board = kept.board || {hidden: {}, net: "", window: null};
    var whole = picture.getAttribute("viewBox").split(" ").map(Number), layers = {}, nets = {};
    bar.className = "bar";
    picture.querySelectorAll("g[class]").forEach(function (group) {
      var kind = group.getAttribute("class");
      if (/^copper-\d+$/.test(kind)) (layers[kind] = layers[kind] || []).push(group);
      if (/^net-/.test(kind)) (nets[kind.slice(4)] = nets[kind.slice(4)] || []).push(group);
    });
    function paint() {
      Object.keys(layers).forEach(function (name) {
        layers[name].forEach(function (group) { group.style.display = state.hidden[name] ? "none" : ""; });
      });
      Object.keys(nets).forEach(function (name) {
        nets[name].forEach(function (group) { group.style.opacity = state.net && state.net !== name ? 0.12 : ""; });
      });
      picture.setAttribute("viewBox", (state.window || whole).join(" "));
    }
    Object.keys(layers).sort().forEach(function (name) {
      bar.appendChild(page.check(name.replace("-", " "), !state.hidden[name], function (on) { state.hidden[name] = !on; paint(); }));
    });
    var choice = document.createElement("select"), label = document.createElement("label");
    [""].concat(Object.keys(nets).sort()).forEach(function (name) {
      var option = document.createElement("option");
      option.value = name;
      option.textContent = name || "all nets";
      choice.appendChild(option);
    });
    choice.value = state.net;
    choice.addEventListener("change", function () { state.net = choice.value; paint(); });
    label.append("net ", choice);
    bar.appendChild(label);
    function zoom(by, at) {
      var box = state.window || whole, x = at ? at[0] : 0.5, y = at ? at[1] : 0.5;
      var wide = Math.min(whole[2], box[2] * by), high = wide * whole[3] / whole[2];
      place([box[0] + x * (box[2] - wide), box[1] + y * (box[3] - high), wide, high]);
    }
    function place(box) {
      box[0] = Math.max(whole[0], Math.min(whole[0] + whole[2] - box[2], box[0]));
      box[1] = Math.max(whole[1], Math.min(whole[1] + whole[3] - box[3], box[1]));
      state.window = box;
      paint();
    }
    function step(dx, dy) {
      var box = (state.window || whole).slice();
      box[0] += dx * box[2];
      box[1] += dy * box[3];
      place(box);
    }
    bar.append(page.button("nearer", function () { zoom(0.6); }), page.button("farther", function () { zoom(1 / 0.6); }),
      page.button("all", function () { state.window = null; paint(); }), said);
    figure.insertBefore(bar, figure.firstChild);
    figure.querySelector("svg").setAttribute("role", "group"); // it holds what can be pointed at
    picture.setAttribute("role", "group");
    picture.setAttribute("tabindex", "0");
    picture.setAttribute("aria-label", "the board: arrow keys move it, plus and minus make it nearer and farther");
    picture.addEventListener("keydown", function (event) {
      var by = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]}[event.key];
      if (by) step(by[0], by[1]);
      else if (event.key === "+" || event.key === "=") zoom(0.6);
      else if (event.key === "-") zoom(1 / 0.6);
      else return;
      event.preventDefault();
    });
    picture.addEventListener("wheel", function (event) {
      if (!event.ctrlKey && document.activeElement !== picture) return;
      var box = picture.getBoundingClientRect();
      zoom(event.deltaY > 0 ? 1.15 : 1 / 1.15, [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height]);
      event.preventDefault();
    }, {passive: false});
    picture.addEventListener("pointerdown", function (event) {
      var last = [event.clientX, event.clientY], box = picture.getBoundingClientRect();
      function move(next) {
        step((last[0] - next.clientX) / box.width, (last[1] - next.clientY) / box.height);
        last = [next.clientX, next.clientY];
      }
      function end() {
        window.removeEventListener("pointermove", move);
        window.removeEventListener("pointerup", end);
      }
      window.addEventListener("pointermove", move);
      window.addEventListener("pointerup", end);
    });
    picture.addEventListener("pointerover", function (event) {
      var on = event.target.closest("g[class^=net-]"), layer = event.target.closest("g[class^=copper-]");
      said.textContent = on ? on.getAttribute("class").slice(4) + (layer ? ", " + layer.getAttribute("class").replace("-", " ") : "") : "";
    });
    page.look = function (group) { // brings a part of the drawing into the window
      var own = group.getBBox(), wide = Math.min(whole[2], Math.max(own.width * 6, whole[2] / 6));
      var high = wide * whole[3] / whole[2];
      place([own.x + own.width / 2 - wide / 2, own.y + own.height / 2 - high / 2, wide, high]);
    };
    paint();
  }

  function findings(root) {
    root.querySelectorAll("[data-place]").forEach(function (finding) {
      var number = finding.getAttribute("data-place"), marks = document.querySelectorAll("[id$='-finding-" + number + "']");
      function light(on) {
        marks.forEach(function (mark) { mark.style.filter = on ? "drop-shadow(0 0 6px #d00000)" : ""; });
      }
      finding.addEventListener("pointerenter", function () { light(true); });
      finding.addEventListener("pointerleave", function () { light(false); });
      finding.querySelectorAll("a[href^='#board-finding']").forEach(function (link) {
        link.addEventListener("click", function (event) {
          var mark = document.getElementById("board-finding-" + number), figure = document.querySelector("figure.board");
          if (!mark || !figure) return;
          event.preventDefault();
          figure.scrollIntoView({block: "center"});
          if (page.look) page.look(mark);
          light(true);
        });
      });
      marks.forEach(function (mark) {
        mark.style.cursor = "pointer";
        mark.setAttribute("tabindex", "0");
        mark.setAttribute("role", "button");
        mark.setAttribute("aria-label", "finding " + number);
        function show() {
          finding.open = true;
          finding.scrollIntoView({block: "center"});
          finding.querySelector("summary").focus();
        }
        mark.addEventListener("click", show);
        mark.addEventListener("keydown", function (event) { if (event.key === "Enter") show(); });
      });
    });
  }

  function begin(id, start) { // a view that needs data and may be missing
    var root = document.getElementById(id), known = data(id + "-data");
    if (!root || !known) return;
    var works = start(root, known, kept);
    root.hidden = !works;
    document.querySelectorAll("[data-without=" + id + "]").forEach(function (other) { other.hidden = works; });
  }

  page.begin = function (root) { // of the whole page, or of a part that is new in it
    try {
      var drawn = root.querySelector("figure.board"), has = function (id) { return root.querySelector("#" + id); };
      if (drawn) board(drawn);
      if (drawn || root.matches("[data-stage=findings]") || root === document.documentElement) {
        document.querySelectorAll("[data-stage=findings]").forEach(findings);
      }
      if (has("solids")) begin("solids", page.solids);
      if (has("pushed")) begin("pushed", page.pushed);
      document.documentElement.setAttribute("data-sitscad-ready", "1");
    } catch (error) {
      document.documentElement.setAttribute("data-sitscad-error", String(error && error.stack || error));
    }
  };
  window.addEventListener("beforeprint", function () {
    document.querySelectorAll("details.finding").forEach(function (each) { each.open = true; });
  });
  window.addEventListener("error", function (event) {
    document.documentElement.setAttribute("data-sitscad-error", event.message);
  });
  page.begin(document.documentElement);
})(window.sitscad = window.sitscad || {});
