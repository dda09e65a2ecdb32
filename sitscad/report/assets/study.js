// The page of a study: designs can be pointed at and chosen, axes brushed. Without scripts all of it is there as
// pictures and tables.
(function () {
  "use strict";
  var root = document.documentElement, data = JSON.parse(document.getElementById("study-data").textContent);
  var marks = {}, chosen = document.getElementById("chosen"), axes = data.keys.concat(data.measures);

  function number(element) { // of the design that an element of a chart stands for
    var group = element.closest ? element.closest("g.design") : null;
    return group ? Number(group.id.replace(/^.*-/, "")) : -1;
  }

  function written(measure, value) {
    return value === null || value === undefined ? "-" : Number(value.toPrecision(4)) + (measure.unit ? " " + measure.unit : "");
  }

  function words(k) {
    var point = data.points[k], lines = point[3] ? ["design " + point[3]] : [];
    data.measures.forEach(function (measure, i) { lines.push(measure.name + " " + written(measure, point[1][i])); });
    data.keys.forEach(function (key, i) { lines.push(key.name + ": " + key.values[point[0][i]]); });
    if (point[4].length) lines.push("refused by " + point[4].join(", "));
    return lines.join("\n");
  }

  function pointing() {
    var tip = document.createElement("div");
    tip.className = "tip";
    tip.hidden = true;
    document.body.appendChild(tip);
    document.addEventListener("pointermove", function (event) {
      var k = number(event.target);
      tip.hidden = k < 0;
      if (k < 0) return;
      tip.textContent = words(k);
      tip.style.left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8) + "px";
      tip.style.top = Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 8) + "px";
    });
    document.addEventListener("click", function (event) {
      var k = number(event.target);
      if (k >= 0) choose(k);
    });
  }

  function row(name, before, here) {
    var made = document.createElement("tr");
    [name, before, here].forEach(function (text, i) {
      var cell = document.createElement("td");
      cell.textContent = text;
      if (i) cell.className = "number";
      if (i === 2 && before !== here && Number(before) !== Number(here)) cell.style.fontWeight = "600";
      made.appendChild(cell);
    });
    return made;
  }

  function choose(k) {
    var point = data.points[k], body = chosen.querySelector("tbody"), paper = chosen.querySelector(".paper");
    document.querySelectorAll(".design.on").forEach(function (one) { one.classList.remove("on"); });
    (marks[k] || []).forEach(function (one) { one.classList.add("on"); });
    body.textContent = "";
    data.measures.forEach(function (measure, i) {
      body.appendChild(row(measure.name, written(measure, measure.base), written(measure, point[1][i])));
    });
    data.keys.forEach(function (key, i) { body.appendChild(row(key.name, key.base, key.values[point[0][i]])); });
    if (point[4].length) body.appendChild(row("refused by", "", point[4].join(", ")));
    paper.innerHTML = data.sketches[k] || "";
    paper.hidden = !data.sketches[k];
    chosen.querySelector("select").value = /^(front|kept|nearest)$/.test(point[2]) ? String(k) : "";
    chosen.setAttribute("data-chosen", k);
  }

  function choice() { // the front in a list: what the keyboard reaches
    var list = chosen.querySelector("select"), first = document.createElement("option");
    first.value = "";
    first.textContent = "another one";
    list.appendChild(first);
    data.points.forEach(function (point, k) {
      if (!/^(front|kept|nearest)$/.test(point[2])) return;
      var option = document.createElement("option");
      option.value = String(k);
      option.textContent = (point[3] ? "design " + point[3] + ": " : point[2] === "nearest" ? "nearest: " : "") + data.measures.map(function (measure, i) {
        return written(measure, point[1][i]);
      }).join(", ");
      list.appendChild(option);
    });
    list.addEventListener("change", function () { if (list.value) choose(Number(list.value)); });
    if (data.points.length) choose(0);
    chosen.hidden = !data.points.length;
  }

  function brushing() {
    var picture = document.querySelector("#lines svg"), held = {};
    if (!picture) return;
    picture.setAttribute("role", "group");

    function place(k, i) { // of a design on an axis, from 0 to 1, as it is drawn
      var n = data.keys.length, point = data.points[k], axis = axes[i];
      if (i < n) return (point[0][i] + 0.25) / (axis.values.length - 0.5);
      return Math.min(1, Math.max(0, (point[1][i - n] - axis.low) / (axis.high - axis.low)));
    }
    function paint() {
      Object.keys(marks).forEach(function (k) {
        var on = Object.keys(held).every(function (i) { var at = place(k, i); return at >= held[i][0] && at <= held[i][1]; });
        marks[k].forEach(function (one) { one.classList.toggle("off", !on); });
      });
    }
    picture.querySelectorAll("g.axis").forEach(function (group) {
      var i = Number(group.id.replace(/^.*-/, "")), line = group.querySelector("path").getBBox();
      var grip = rect("grip", line.x - 24, line.y - 6, 48, line.height + 12);
      var brush = rect("brush", line.x - 9, 0, 18, 0), begun = null;
      grip.setAttribute("tabindex", "0");
      grip.setAttribute("role", "slider");
      grip.setAttribute("aria-label", axes[i].name + ": arrow keys narrow it from above and from below, Escape frees it");
      picture.append(brush, grip);
      show();

      function show() {
        var own = held[i];
        brush.style.display = own ? "" : "none";
        grip.setAttribute("aria-valuenow", own ? own[1].toFixed(2) : "1");
        grip.setAttribute("aria-valuetext", own ? own[0].toFixed(2) + " to " + own[1].toFixed(2) + " of the axis" : "all of it");
        if (own) {
          brush.setAttribute("y", line.y + (1 - own[1]) * line.height);
          brush.setAttribute("height", Math.max(1, (own[1] - own[0]) * line.height));
        }
        paint();
      }
      function hold(a, b) {
        var low = Math.max(0, Math.min(a, b)), high = Math.min(1, Math.max(a, b));
        if (high - low < 0.015 || high - low > 0.999) delete held[i];
        else held[i] = [low, high];
        show();
      }
      function at(event) {
        var box = group.getBoundingClientRect();
        return 1 - (event.clientY - box.top) / box.height;
      }
      grip.addEventListener("pointerdown", function (event) {
        begun = at(event);
        grip.setPointerCapture(event.pointerId);
        event.preventDefault();
      });
      grip.addEventListener("pointermove", function (event) { if (begun !== null) hold(begun, at(event)); });
      grip.addEventListener("pointerup", function (event) { hold(begun, at(event)); begun = null; });
      grip.addEventListener("keydown", function (event) {
        var own = held[i] || [0, 1], by = {ArrowDown: [0, -0.05], ArrowUp: [0.05, 0]}[event.key];
        if (event.key === "Escape") hold(0, 1);
        else if (by) hold(own[0] + by[0], own[1] + by[1]);
        else return;
        event.preventDefault();
      });
    });

    function rect(kind, x, y, width, height) {
      var made = document.createElementNS("http://www.w3.org/2000/svg", "rect");
      [["class", kind], ["x", x], ["y", y], ["width", width], ["height", height]].forEach(function (pair) {
        made.setAttribute(pair[0], pair[1]);
      });
      return made;
    }
  }

  try {
    document.querySelectorAll("g.design").forEach(function (one) {
      var k = number(one);
      (marks[k] = marks[k] || []).push(one);
    });
    pointing();
    choice();
    brushing();
    document.querySelectorAll("[data-without=study]").forEach(function (one) { one.hidden = true; });
    root.setAttribute("data-sitscad-ready", "1");
  } catch (error) {
    root.setAttribute("data-sitscad-error", String(error && error.stack || error));
  }
})();
