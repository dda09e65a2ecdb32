// The page of a study: designs can be pointed at and chosen. Without scripts all of it is there as
// pictures and tables.
(function () {
  "use strict";
  var root = document.documentElement, data = JSON.parse(document.getElementById("study-data").textContent);
  var marks = {}, chosen = document.getElementById("chosen");

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

  try {
    document.querySelectorAll("g.design").forEach(function (one) {
      var k = number(one);
      (marks[k] = marks[k] || []).push(one);
    });
    pointing();
    choice();
    document.querySelectorAll("[data-without=study]").forEach(function (one) { one.hidden = true; });
    root.setAttribute("data-sitscad-ready", "1");
  } catch (error) {
    root.setAttribute("data-sitscad-error", String(error && error.stack || error));
  }
})();
