// The page while its spec is edited: parts that are ready take the place of the old ones, camera and scroll stay, what
// is not ready yet stays grey; a spec that cannot be read leaves the last good page under its findings.
(function (page) {
  "use strict";

  var main = document.querySelector("main"), news = document.createElement("aside"), asked = 0;
  news.setAttribute("role", "status");
  news.className = "banner live";
  news.hidden = true;
  main.parentNode.insertBefore(news, main);

  function key(part) {
    var title = part.querySelector("h2");
    return part.tagName + ":" + (part.getAttribute("data-stage") || (title ? title.textContent : ""));
  }
  function sources(text) { // of a page's parts by their key, as they came: scripts change them afterwards
    var read = new DOMParser().parseFromString(text, "text/html"), found = new Map();
    read.querySelectorAll("main > header, main > section, main > div.tiles, main > p").forEach(function (part) { found.set(key(part), part.outerHTML); });
    return {title: read.title, parts: found};
  }
  var shown = null;

  function take(text, stage) {
    var next = sources(text), first = shown === null, scrolled = window.scrollY;
    document.title = next.title;
    if (first) shown = sources(document.documentElement.outerHTML).parts;
    var own = new Map();
    main.querySelectorAll(":scope > header, :scope > section, :scope > div.tiles, :scope > p").forEach(function (part) { own.set(key(part), part); });
    var after = null;
    next.parts.forEach(function (source, name) {
      var part = own.get(name);
      if (!part || shown.get(name) !== source) {
        var holds = document.createElement("template");
        holds.innerHTML = source;
        var made = holds.content.firstChild;
        if (part) part.replaceWith(made);
        else if (after) after.after(made);
        else main.prepend(made);
        part = made;
        shown.set(name, source);
        page.begin(made);
      }
      part.classList.remove("stale");
      after = part;
    });
    own.forEach(function (part, name) {
      if (next.parts.has(name)) return;
      if (stage === "last") { part.remove(); shown.delete(name); }
      else part.classList.add("stale");
    });
    window.scrollTo(window.scrollX, scrolled);
  }

  function say(event) {
    var lines = [];
    (event.changes.new || []).forEach(function (one) { lines.push("+ " + one.rule + " " + one.message); });
    (event.changes.gone || []).forEach(function (one) { lines.push("- " + one.rule + " " + one.message); });
    Object.keys(event.changes.numbers || {}).forEach(function (name) {
      var pair = event.changes.numbers[name];
      if (pair[0]) lines.push(name + ": " + pair[0] + " \u2192 " + pair[1]);
    });
    return lines;
  }

  var lines = [], revision = 0, closed = 0; // the revision whose news was closed: the next one opens them again
  function close() {
    closed = revision;
    news.hidden = true;
    main.style.marginBottom = "";
  }
  page.live = function (event) {
    var fresh = event.revision !== revision;
    if (fresh) { revision = event.revision; lines = []; }
    document.documentElement.setAttribute("data-sitscad-revision", event.revision + ":" + event.stage);
    lines = lines.concat(say(event));
    var refused = event.stage === "failed" || (event.stage === "findings" && event.unreadable);
    main.classList.toggle("stale", refused || (main.classList.contains("stale") && !fresh && event.stage !== "findings"));
    if (event.stage === "failed") lines = [event.message];
    if (refused && event.findings) lines = event.findings.map(function (one) { return "line " + one.line + ": " + one.rule + " " + one.message; });
    news.hidden = !lines.length || closed === revision;
    news.textContent = "";
    var button = document.createElement("button");
    button.type = "button";
    button.textContent = "close";
    button.addEventListener("click", close);
    news.appendChild(button);
    lines.slice(0, 12).forEach(function (line) {
      var row = document.createElement("div");
      row.textContent = line;
      news.appendChild(row);
    });
    main.style.marginBottom = news.hidden ? "" : news.offsetHeight + "px"; // the page's end stays in sight
    if (refused || !event.has_page) return;
    var number = ++asked;
    fetch("/").then(function (answer) { return answer.text(); }).then(function (text) {
      if (number === asked) take(text, event.last ? "last" : event.stage);
    });
  };
  new EventSource("/events").onmessage = function (message) { page.live(JSON.parse(message.data)); };
})(window.sitscad = window.sitscad || {});
