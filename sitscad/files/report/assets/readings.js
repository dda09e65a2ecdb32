// Readings as they come: bars of coils and forces, by lines from a serial port (Web Serial) or by events of a server.
(function (page) {
  "use strict";

  var data = JSON.parse(document.getElementById("readings-data").textContent), maps = data.maps;
  var counted = {good: 0, lost: 0, corrupted: 0, another: 0, starts: 0}, sequence = null, isFirst = true;
  var tare = null, taring = null, TARES = 16, latest = null, drawn = false;

  function out(name) { return document.querySelector('[data-out="' + name + '"]'); }
  function put(name, text) { var cell = out(name); if (cell) cell.textContent = text; }
  function say(text) { put("said", text); }

  // CRC-16 CCITT from 0xFFFF, of ASCII.
  page.crc = function (text) {
    var found = 0xFFFF;
    for (var k = 0; k < text.length; k++) {
      found ^= (text.charCodeAt(k) & 0xFF) << 8;
      for (var bit = 0; bit < 8; bit++) found = (found & 0x8000 ? found << 1 ^ 0x1021 : found << 1) & 0xFFFF;
    }
    return found;
  };

  // A line of firmware/sensor_line.h; what is not to be used is counted.
  page.line = function (line) {
    var first = isFirst, found = /^(.*)\*([0-9A-F]{4})$/.exec(line = line.trim());
    isFirst = false;
    if (!line) return;
    if (line[0] === "#") { say(line.slice(1).trim()); return; }
    if (!found || page.crc(found[1]) !== parseInt(found[2], 16)) { if (!first) counted.corrupted++; count(); return; }
    var cells = found[1].split(",");
    if (cells[0] === "id") return;
    var values = cells.slice(2, 2 + 2 * data.coils.length);
    if (cells[0] !== data.id && /^[0-9A-F]{8}$/.test(cells[0])) counted.another++;
    else if (cells[0] !== data.id || values.length < 2 * data.coils.length ||
      !cells.slice(1, 2).concat(values).every(function (cell) { return /^\d{1,10}$/.test(cell); })) counted.corrupted++;
    else {
      counted.good++;
      if (sequence !== null && +cells[1] > sequence) counted.lost += +cells[1] - sequence - 1;
      else if (sequence !== null) counted.starts++;
      sequence = +cells[1];
      page.take({counts: values.filter(function (_, k) { return k % 2 === 0; }).map(Number),
        status: values.filter(function (_, k) { return k % 2; }).map(Number)});
    }
    count();
  };
  function count() {
    put("lines", counted.good + " lines, " + counted.lost + " lost, " + counted.corrupted + " corrupted, " + counted.another +
      " of another sensor" + (counted.starts ? ", " + counted.starts + " starts of the microcontroller" : ""));
    if (counted.another && !counted.good) say("The lines are of another sensor, or of other settings, than this page.");
  }

  function isGood(status) { return status === 0 || status === data.status.length - 1; }

  // A reading: counts and status of every coil, in the order of the design.
  page.take = function (reading) {
    latest = reading;
    if (taring !== null && reading.status.every(isGood)) {
      taring.push(reading.counts);
      if (taring.length === TARES) {
        tare = reading.counts.map(function (_, k) {
          return taring.reduce(function (sum, one) { return sum + one[k]; }, 0) / TARES;
        });
        taring = null;
      }
    }
    if (!drawn) { drawn = true; requestAnimationFrame(show); }
  };
  page.tare = function () { tare = null; taring = []; };

  function bar(name, share) { // of half the width, from the middle
    var mark = out("bar." + name), size = Math.min(Math.abs(share), 1) * 50;
    mark.style.width = size + "%";
    mark.style.left = (share < 0 ? 50 - size : 50) + "%";
    mark.parentNode.classList.toggle("full", Math.abs(share) > 1);
  }
  function show() {
    drawn = false;
    data.coils.forEach(function (coil, k) {
      var counts = latest.counts[k], from = tare ? tare[k] : coil.rest, status = latest.status[k];
      put("counts." + coil.name, counts.toFixed(0));
      put("frequency_Hz." + coil.name, (counts * data.hz_per_count).toFixed(0));
      put("change_Hz." + coil.name, ((counts - from) * data.hz_per_count).toFixed(0));
      put("status." + coil.name, data.status[status] || data.status[1]);
      out("status." + coil.name).className = isGood(status) ? status ? "warned" : "good" : "bad";
      bar(coil.name, isGood(status) ? (counts - from) / coil.span : 0);
    });
    var words = "";
    maps.forEach(function (map) { // of each cell its own, which reads its own coils
      function own(all) { return map.columns.map(function (k) { return all[k]; }); }
      var from = tare && own(tare).every(function (one) { return one !== null; }), good = own(latest.status).every(isGood);
      var read = from && good ? page.forces(map, own(latest.counts), own(tare)) : null;
      map.axes.forEach(function (axis, k) {
        var shown = axis.indexOf("moment") === 0 ? 1e3 : 1;
        put("force_N." + map.prefix + axis, read ? (shown * read.forces[k]).toFixed(3) : "\u2013");
        bar(map.prefix + axis, read ? read.forces[k] / map.full_scale[k] : 0);
      });
      words = words || (!from ? taring ? "Leave it alone: the tare is being taken." :
        "No forces before a tare: press it with nothing on the sensor." : !read ? "No forces: a coil has no good reading." :
        read.holds ? "" : "Beyond what the map was made for: forces are those where it ends.");
    });
    if (maps.length) put("range", words);
  }

  function failed(error) { say(String(error && error.message || error)); document.querySelector("[data-do=connect]").disabled = false; }

  page.connect = async function () {
    var port = await navigator.serial.requestPort();
    await port.open({baudRate: +document.querySelector("[data-in=baud]").value});
    document.querySelector("[data-do=connect]").disabled = true;
    say("Connected: a board that starts takes some seconds.");
    var reader = port.readable.getReader(), decoder = new TextDecoder("windows-1252"), rest = "";
    isFirst = true;
    sequence = null;
    for (;;) {
      var got = await reader.read();
      if (got.done) break;
      var lines = (rest + decoder.decode(got.value, {stream: true})).split("\n");
      rest = lines.pop();
      if (rest.length > 4096) { counted.corrupted++; rest = ""; }
      lines.forEach(page.line);
    }
    failed("The port was closed.");
  };

  function opened(text) { // calibration.json of a sensor that was measured
    var read, next, before;
    try {
      read = JSON.parse(text);
      before = maps.filter(function (one) {
        return one.sensor === read.map.sensor && String(one.coils) === String(read.map.coils) && String(one.axes) === String(read.map.axes);
      })[0];
      if (!before) { say("That calibration is of another sensor."); return; }
      next = Object.assign({}, read.map, {least: before.least, beyond: before.beyond, columns: before.columns, prefix: before.prefix});
      var rest = next.columns.map(function (k) { return data.coils[k].rest; });
      if (!page.forces(next, rest, rest).forces.concat(next.axes.map(function (_, k) { return next.error[k]; })).every(Number.isFinite))
        throw new Error("no force");
    } catch (error) { say("That is no calibration.json: the map stays as it was."); return; }
    maps[maps.indexOf(before)] = next;
    put("map", (read.is_calibrated ? "Forces by the calibration that was opened" : "Forces by a map that is not calibrated") +
      (maps.length > 1 ? ", of " + next.coils.join(", ") + "." : "."));
    next.axes.forEach(function (axis, k) {
      put("sigma_N." + next.prefix + axis, ((axis.indexOf("moment") === 0 ? 1e3 : 1) * next.error[k]).toPrecision(2));
    });
    say("");
  }

  window.addEventListener("error", function (event) { document.documentElement.dataset.sitscadError = event.message; });
  function press(name, act) { var button = document.querySelector("[data-do=" + name + "]"); if (button) button.addEventListener("click", act); return button; }
  press("tare", page.tare);
  var file = document.querySelector("[data-in=calibration]"), button = press("connect", function () { page.connect().catch(failed); });
  if (file) file.addEventListener("change", function () {
    if (file.files.length) file.files[0].text().then(opened).catch(failed);
    file.value = ""; // the same file may be opened again
  });
  if (data.source === "events") {
    var events = new EventSource("/events");
    events.onmessage = function (message) {
      var told = JSON.parse(message.data);
      tare = told.tare;
      page.take(told);
    };
    events.onerror = function () { say("`sitscad read` has ended."); };
  } else if (!navigator.serial) {
    button.disabled = true;
    say("This browser has no Web Serial, so nothing can be read here: Chromium, Chrome and Edge on a computer have it. " +
      "`sitscad read serial:PORT --serve` shows the same in any browser.");
  }
  document.documentElement.dataset.sitscadReady = "1";
})(window.sitscad = window.sitscad || {});
