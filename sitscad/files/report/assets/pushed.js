// The pushed sensor: forces and tilt, or moments, move the target; frequencies, counts and the forces read back follow, by the
// table that the package's data sheet has (`response_table` of the library) and its calibration's map.
(function (page) {
  "use strict";

  function monomials(inside, powers) {
    return powers.map(function (row) {
      return row.reduce(function (product, power, k) { return product * Math.pow(inside[k], power); }, 1);
    });
  }
  function clipped(value, low, high) { return Math.max(low, Math.min(high, value)); }

  // Frequencies (Hz) and travel (m: x, y, z; of a free target also rad about x and y) at the five inputs.
  page.responds = function (table, asked) {
    var inside = asked.map(function (value, k) {
      return clipped(2 * (value - table.low[k]) / (table.high[k] - table.low[k]) - 1, -1, 1);
    });
    var terms = monomials(inside, table.powers), count = table.coils.length, sums = new Array(table.coefficients[0].length).fill(0);
    terms.forEach(function (term, t) {
      for (var k = 0; k < sums.length; k++) sums[k] += term * table.coefficients[t][k];
    });
    return {
      frequency: table.rest_Hz.map(function (rest, k) { return rest * Math.exp(sums[k]); }), travel: sums.slice(count)
    };
  };

  // Forces (N) of readings after a tare, and whether the map was made for them: `InverseMap` of the library.
  page.forces = function (map, readings, tare) {
    var gives = readings.map(function (reading, k) {
      var share = (tare[k] - reading) / reading, change = share * (2 + share);
      return Math.log(Math.max(1 - map.gain[k] * change, map.least));
    });
    var mixed = map.mix.map(function (row) {
      return row.reduce(function (sum, weight, k) { return sum + weight * gives[k]; }, 0);
    });
    var holds = mixed.every(function (value, k) {
      return value >= map.low[k] - map.beyond && value <= map.high[k] + map.beyond;
    });
    var at = mixed.map(function (value, k) { return clipped(value, map.low[k] - map.beyond, map.high[k] + map.beyond); });
    var terms = monomials(at, map.powers);
    return {holds: holds, forces: map.full_scale.map(function (full, k) {
      return full * map.coefficients[k].reduce(function (sum, value, t) { return sum + value * terms[t]; }, 0);
    })};
  };

  function counted(conversion, frequency, coil, offsets) {
    var offset = (offsets || conversion.offsets)[coil] || 0, step = conversion.step;
    return Math.floor((frequency * conversion.counts_per_Hz - offset) / step + 0.5) * step + offset;
  }

  var WORDS = {normal: "normal", shear_x: "shear along x", shear_y: "shear along y",
    moment_x: "moment about x, N mm", moment_y: "moment about y, N mm"};
  var FORCES = [["normal_N", "normal", "N", 1], ["shear_x_N", "shear along x", "N", 1], ["shear_y_N", "shear along y", "N", 1]];
  var INPUTS = {
    held: FORCES.concat([["rx_deg", "tilt about x", "deg", 180 / Math.PI], ["ry_deg", "tilt about y", "deg", 180 / Math.PI]]),
    free: FORCES.concat([["moment_x_Nmm", "moment about x", "N mm", 1e3], ["moment_y_Nmm", "moment about y", "N mm", 1e3]])
  };
  var ROTATIONS = {
    held: "All numbers here are those of a target that is kept level, unless it is tilted by the sliders.",
    free: "All numbers here are those of a target that is free to tilt, as the map and the data sheet have it: forces and " +
      "moments tilt it. They act on the middle of its outermost face."
  };

  function svg(name, set, inside) {
    var made = document.createElementNS("http://www.w3.org/2000/svg", name);
    Object.keys(set).forEach(function (key) { made.setAttribute(key, set[key]); });
    if (inside !== undefined) made.textContent = inside;
    return made;
  }

  // A section along x (0) or y (1): the board still, the pad a quadrilateral from it to the target's near face.
  function section(shape, along, turned, travel) {
    var wide = 360, high = 190, floor = 150, own = shape.axes[along], reach = own.board[1] - own.board[0];
    var across = (wide - 40) / reach, up = 70 / shape.pad_mm, middle = (own.board[0] + own.board[1]) / 2;
    function x(mm) { return wide / 2 + across * (mm - middle); }
    var made = svg("svg", {viewBox: "0 0 " + wide + " " + high, role: "img", class: "cut"});
    made.appendChild(svg("title", {}, "section along " + "xy"[along]));
    var tilt = along === 0 ? -turned[1] : turned[0], shift = up * travel[along] * 1e3, down = -up * travel[2] * 1e3;
    function corner(mm, height) { // of the target, which turns about the middle of its near face
      var off = mm - own.middle;
      return [x(mm) + shift, floor - up * shape.pad_mm + down - up * off * Math.sin(tilt) - up * height];
    }
    function polygon(points, kind) {
      made.appendChild(svg("polygon", {points: points.map(function (p) { return p[0].toFixed(1) + "," + p[1].toFixed(1); }).join(" "), class: kind}));
    }
    polygon([[x(own.board[0]), floor], [x(own.board[1]), floor], [x(own.board[1]), floor + 14], [x(own.board[0]), floor + 14]], "board");
    own.coils.forEach(function (coil) {
      polygon([[x(coil[0]), floor + 3], [x(coil[1]), floor + 3], [x(coil[1]), floor + 9], [x(coil[0]), floor + 9]], "copper");
    });
    polygon([[x(own.pad[0]), floor], [x(own.pad[1]), floor], corner(own.pad[1], 0), corner(own.pad[0], 0)], "pad");
    polygon([corner(own.target[0], 0), corner(own.target[1], 0), corner(own.target[1], shape.target_mm), corner(own.target[0], shape.target_mm)], "plate");
    made.appendChild(svg("text", {x: 8, y: high - 8}, "section along " + "xy"[along] + "; heights and moves " + (up / across).toFixed(1) + " times as large as widths"));
    return made;
  }

  page.pushed = function (root, data, kept) {
    var table = data.table, map = data.map, isFree = table.rotation === "free";
    if (!kept.pushed || kept.pushed.rotation !== table.rotation) kept.pushed = {asked: [0, 0, 0, 0, 0], rotation: table.rotation};
    var state = kept.pushed;
    root.querySelector("[data-out=rotation]").textContent = ROTATIONS[table.rotation];
    var inputs = root.querySelector(".inputs"), bodies = root.querySelectorAll("tbody"), pictures = root.querySelector(".cuts");
    var coils = bodies[0], axes = bodies[1];
    axes.parentNode.hidden = !map;
    var rest = page.responds(table, [0, 0, 0, 0, 0]).frequency;
    var tare = rest.map(function (f, k) { return counted(data.conversion, f, k); }), cells = data.cells;
    inputs.innerHTML = "";
    if (cells) {
      if (!cells.all[state.cell]) state.cell = cells.table - 1;
      var chosen = document.createElement("select"), which = document.createElement("label");
      cells.all.forEach(function (each, k) { chosen.add(new Option((k + 1) + " (" + each.coils.join(", ") + ")", k)); });
      chosen.value = state.cell;
      chosen.setAttribute("data-in", "cell");
      chosen.addEventListener("input", function () { state.cell = +chosen.value; show(); });
      which.append("pushed is cell ", chosen);
      inputs.append(which, "Cell " + cells.table + " is solved, and forces are read back of it; others read in proportion to their " +
        "signal. Of neighbours, on which nothing lies, it is said what they change at most.");
    }
    var sliders = INPUTS[table.rotation].map(function (each, k) {
      var label = document.createElement("label"), slider = document.createElement("input"), value = document.createElement("output");
      slider.type = "range";
      slider.min = table.low[k] * each[3];
      slider.max = table.high[k] * each[3];
      slider.step = (table.high[k] - table.low[k]) * each[3] / 400;
      slider.setAttribute("data-in", each[0]);
      label.append(each[1] + " ", slider, value);
      inputs.appendChild(label);
      slider.addEventListener("input", function () { state.asked[k] = +slider.value / each[3]; show(); });
      return {slider: slider, value: value, unit: each[2], factor: each[3]};
    });
    inputs.appendChild(page.button("nothing on it", function () { state.asked = [0, 0, 0, 0, 0]; show(); }));

    function row(body, what, cells) { // cells: text and, where programs read it, its name
      var line = document.createElement("tr"), head = document.createElement("th");
      head.scope = "row";
      head.textContent = what;
      line.appendChild(head);
      cells.forEach(function (each) {
        var cell = document.createElement("td");
        cell.className = "number";
        cell.textContent = each[0];
        cell.setAttribute("data-out", each[1]);
        line.appendChild(cell);
      });
      body.appendChild(line);
    }
    function show() {
      sliders.forEach(function (one, k) {
        one.slider.value = state.asked[k] * one.factor;
        one.value.textContent = (state.asked[k] * one.factor).toPrecision(3) + " " + one.unit;
      });
      var found = page.responds(table, state.asked);
      var counts = found.frequency.map(function (f, k) { return counted(data.conversion, f, k); });
      coils.innerHTML = axes.innerHTML = "";
      function reads(names, frequency, from, counted) {
        names.forEach(function (name, k) {
          row(coils, name, [[frequency[k].toFixed(0), "frequency_Hz." + name],
            [(frequency[k] - from[k]).toFixed(0), "change_Hz." + name], [counted[k].toFixed(0), "counts." + name]]);
        });
      }
      var isSolved = !cells || state.cell === cells.table - 1;
      if (cells) {
        var pushed = other(cells.all[state.cell], found, reads);
        counts = pushed[0];
        tare = pushed[1];
      } else reads(table.coils, found.frequency, rest, counts);
      var words = [], full = table.full_scale_N, sheared = Math.hypot(state.asked[1], state.asked[2]);
      if (state.asked[0] > full.normal * 1.0001) words.push("normal force beyond " + full.normal.toPrecision(3) + " N");
      if (sheared > full.shear * 1.0001) words.push("shear beyond " + full.shear.toPrecision(3) + " N");
      var moments = ["moment_x", "moment_y"].map(function (name, k) { // two share one limit, in parts of their full scales
        return isFree && table.full_scale_Nm[name] ? state.asked[3 + k] / table.full_scale_Nm[name] : 0;
      });
      if (Math.hypot(moments[0], moments[1]) > 1.0001) words.push("moments beyond " + ["moment_x", "moment_y"].map(function (name) {
        return (1e3 * table.full_scale_Nm[name]).toPrecision(3);
      }).join(" and ") + " N mm (together within the ellipse of both)");
      axes.parentNode.hidden = !map || !isSolved;
      root.querySelector("[data-out=unsolved]").textContent = !map || isSolved ? "" : "No forces are read back of cell " +
        (state.cell + 1) + ": cell " + cells.table + " alone is solved here. The map of this one is in calibration/cell-" +
        (state.cell + 1) + "/.";
      if (map && isSolved) {
        var read = page.forces(map, counts, tare);
        map.axes.forEach(function (axis, k) {
          var shown = axis.indexOf("moment") === 0 ? 1e3 : 1, put = state.asked[Object.keys(WORDS).indexOf(axis)];
          row(axes, WORDS[axis], [[(shown * put).toFixed(3), "load_N." + axis], [(shown * read.forces[k]).toFixed(3), "force_N." + axis],
            [(shown * map.error[k]).toPrecision(2), "sigma_N." + axis]]);
        });
        if (!read.holds) words.push("the readings lie beyond what the map was made for: forces are those where it ends");
      }
      var said = root.querySelector("[data-out=range]");
      said.textContent = words.length ? "Beyond the working range: " + words.join("; ") + "." : "";
      pictures.innerHTML = "";
      [0, 1].forEach(function (along) {
        var picture = section(data.shape, along, isFree ? found.travel.slice(3) : state.asked.slice(3), found.travel);
        drag(picture, along);
        pictures.appendChild(picture);
      });
    }
    // A cell's coils in proportion to those of the table's, from where the estimates have them at rest, and how much
    // each of its neighbours' coils changes at most; its counts, and those at rest.
    function other(own, found, reads) {
      var share = found.frequency.map(function (f, k) { return Math.log(f / rest[k]); });
      function at(cell, parts) { return cell.rest_Hz.map(function (f, k) { return f * Math.exp(parts[k] * cell.signal); }); }
      function count(cell, frequency) {
        return frequency.map(function (f, k) { return counted(data.conversion, f, k, cell.offsets); });
      }
      var frequency = at(own, share), largest = Math.max.apply(null, share.map(Math.abs));
      reads(own.coils, frequency, own.rest_Hz, count(own, frequency));
      own.read_by.forEach(function (pair) {
        var cell = cells.all[pair[0] - 1], most = at(cell, cell.coils.map(function () { return pair[1] * largest; }));
        var counts = count(cell, most), still = count(cell, cell.rest_Hz);
        cell.coils.forEach(function (name, k) {
          row(coils, name + " beside it", [[cell.rest_Hz[k].toFixed(0), "frequency_Hz." + name],
            ["at most \u00b1" + Math.ceil(most[k] - cell.rest_Hz[k]), "most_Hz." + name],
            ["at most \u00b1" + (counts[k] - still[k]), "most_counts." + name]]);
        });
      });
      return [count(own, frequency), count(own, own.rest_Hz)];
    }
    function drag(picture, along) {
      picture.addEventListener("pointerdown", function (event) {
        var from = [event.clientX, event.clientY], start = state.asked.slice();
        function move(next) {
          var across = (next.clientX - from[0]) / 150, down = (next.clientY - from[1]) / 150;
          state.asked[1 + along] = clipped(start[1 + along] + across * table.high[1 + along], table.low[1 + along], table.high[1 + along]);
          state.asked[0] = clipped(start[0] + down * table.high[0], 0, table.high[0]);
          show();
        }
        function end() {
          window.removeEventListener("pointermove", move);
          window.removeEventListener("pointerup", end);
        }
        window.addEventListener("pointermove", move);
        window.addEventListener("pointerup", end);
        event.preventDefault();
      });
    }
    show();
    return true;
  };
})(window.sitscad = window.sitscad || {});
