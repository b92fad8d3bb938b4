// The sample browser: clips in sync, and curves with a cursor.
"use strict";

const VIEW = { width: 960, height: 240, left: 40, right: 14, top: 10, bottom: 26 };
const DRIFT = 0.08; // seconds that a clip may be off before it is moved
const SHOWN_AT_FIRST = 3; // systems

// What is shown: sample, frame, and while it plays, when frame 0 would have been.
const state = { sample: null, frame: 0, started: null, shown: new Set() };

// How the curve of a system is drawn, as in the figures.
function strokeOf(label) {
  const { colour, dash, width } = lookOf(label);
  const dashes = dash.map((length) => width * length).join(" ");
  return { stroke: colour, "stroke-dasharray": dashes, "stroke-width": width };
}

function lookOf(label) {
  return page.section.systems.find((system) => system.label === label);
}

function swatch(label) {
  const picture = drawing("svg", { class: "swatch", viewBox: "0 0 36 6" });
  picture.append(drawing("path", { d: "M0 3H36", ...strokeOf(label) }));
  return picture;
}

function frameCount() {
  const lengths = state.sample.systems.flatMap((system) =>
    Object.values(system.curves).map((curve) => curve.length));
  return Math.max(1, ...lengths);
}

function videos() {
  return [...document.querySelectorAll("#clips video")];
}

function showSamples(section) {
  stop();
  const { systems, samples } = section;
  const playing = systems.filter((system) => system.clips);
  const first = (playing.length ? playing : systems).slice(0, SHOWN_AT_FIRST);
  state.shown = new Set(first.map((system) => system.label));
  const boxes = systems.map(({ label, name }) => {
    const box = element("input", { type: "checkbox", checked: state.shown.has(label) });
    box.addEventListener("change", () => {
      state.shown[box.checked ? "add" : "delete"](label);
      renderSample();
    });
    return element("label", {}, box, " ", swatch(label), name);
  });
  fill("choose-systems", element("legend", {}, "systems"), ...boxes);
  fill("choose-sample", ...samples.map((id) => element("option", { value: id }, id)));
  const curved = page.report.metrics.filter((metric) => metric.curve);
  fill("choose-metric", ...curved.map(({ name, heading }) =>
    element("option", { value: name }, heading)));
  fill("without", section.without);
  const [key, id, frame] = decodeURIComponent(location.hash.slice(1)).split("/");
  const asked = key === section.key && samples.includes(id);
  loadSample(asked ? id : samples[0], asked ? Number(frame) || 0 : 0);
}

// The data of a sample are a script, which a page may load from a disk.
function loadSample(id, frame) {
  stop();
  const { key, samples } = page.section;
  document.getElementById("choose-sample").value = id;
  state.frame = frame;
  const number = String(samples.indexOf(id) + 1).padStart(4, "0");
  const script = element("script", { src: `samples/${key}/${number}.js` });
  script.onerror = () => fill("about", `the data of ${id} are missing: ${script.src}`);
  script.onload = () => script.remove();
  document.body.append(script);
}

function onSample(sample) {
  // One that was asked for before may come late.
  if (sample.id !== document.getElementById("choose-sample").value) return;
  state.sample = sample;
  const motion = sample.motion === null ? "" : `, motion ${sample.motion.toFixed(2)}`;
  fill("about", `${sample.materials.join(", ")}; ${sample.count} objects${motion}`);
  document.getElementById("scrub").max = String(frameCount() - 1);
  renderSample();
}

function clip(title, path) {
  const video = element("video", {
    src: path, muted: true, playsInline: true, preload: "auto",
  });
  // A clip that comes late starts where the others are.
  video.addEventListener("loadedmetadata", () => { video.currentTime = timeOf(state.frame); });
  return element("figure", {}, video, element("figcaption", {}, title));
}

function card(title, ...clips) {
  const pair = element("div", { className: "pair" }, ...clips);
  return element("div", { className: "card" }, element("h3", {}, title), pair);
}

function systemCard(system) {
  const clips = [];
  if (system.clip) clips.push(clip("prediction", system.clip));
  if (system.difference) clips.push(clip("difference", system.difference));
  const { name } = lookOf(system.label);
  if (clips.length) return card(name, ...clips);
  const failed = system.outcome !== "ok";
  const text = failed ? `${system.outcome}: ${system.reason}` : "no clip";
  return card(name, element("span", { className: "hint" }, text));
}

function shownSystems() {
  const order = page.section.systems.map((system) => system.label);
  return state.sample.systems
    .filter((system) => state.shown.has(system.label))
    .sort((one, two) => order.indexOf(one.label) - order.indexOf(two.label));
}

function renderSample() {
  const { sample } = state;
  const shown = shownSystems();
  const any = sample.reference || sample.systems.some((system) => system.clip);
  const cards = any ? shown.map(systemCard) : [];
  if (sample.reference) cards.unshift(card("reference", clip("truth", sample.reference)));
  fill("clips", ...cards);
  fill("scores", renderTable(scoresTable(sample, shown)));
  drawCurves();
  seek(state.frame);
}

function scoresTable(sample, shown) {
  const { metrics } = page.report;
  const digits = (value) => (value === null || value === undefined ? "–" : value.toFixed(3));
  const row = (name, outcome, scores) =>
    [name, outcome, ...metrics.map((metric) => digits(scores[metric.name]))];
  const rows = shown.map(({ label, outcome, scores }) =>
    row(lookOf(label).name, outcome, scores));
  if (sample.ceiling) rows.push(row("noise ceiling", "", sample.ceiling));
  return {
    title: `Scores of ${sample.id}`,
    columns: ["system", "outcome", ...metrics.map((metric) => metric.heading)],
    groups: [{ heading: "", rows }],
    texts: 2,
    notes: [],
  };
}

function timeOf(frame) {
  return (frame + 0.5) / page.section.framerate;
}

function seek(frame) {
  state.frame = Math.min(Math.max(Math.round(frame), 0), frameCount() - 1);
  for (const video of videos()) video.currentTime = timeOf(state.frame);
  showFrame();
}

function showFrame() {
  const number = page.section.first + state.frame;
  const seconds = (number / page.section.framerate).toFixed(2);
  document.getElementById("scrub").value = String(state.frame);
  document.getElementById("time").value = `${seconds} s, frame ${number}`;
  const cursor = document.querySelector("#curve .cursor");
  if (cursor) {
    const x = across(state.frame);
    cursor.setAttribute("x1", x);
    cursor.setAttribute("x2", x);
  }
}

function play() {
  if (state.frame >= frameCount() - 1) seek(0);
  state.started = performance.now() - (1000 * state.frame) / page.section.framerate;
  document.getElementById("play").textContent = "pause";
  requestAnimationFrame(tick);
}

function stop() {
  state.started = null;
  document.getElementById("play").textContent = "play";
  for (const video of videos()) video.pause();
}

// One clock moves everything: a clip that drifts from it is put back.
function tick(now) {
  if (state.started === null) return;
  const seconds = (now - state.started) / 1000;
  state.frame = Math.max(0, Math.floor(seconds * page.section.framerate));
  if (state.frame >= frameCount() - 1) {
    stop();
    seek(frameCount() - 1);
    return;
  }
  for (const video of videos()) {
    if (video.paused) video.play().catch(() => video.pause());
    if (Math.abs(video.currentTime - seconds) > DRIFT) video.currentTime = seconds;
  }
  showFrame();
  requestAnimationFrame(tick);
}

function across(frame) {
  const span = VIEW.width - VIEW.left - VIEW.right;
  return VIEW.left + (span * frame) / Math.max(1, frameCount() - 1);
}

function drawing(tag, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

function drawCurves() {
  VIEW.width = Math.max(280, document.getElementById("curve").clientWidth);
  const metric = document.getElementById("choose-metric").value;
  const frames = frameCount();
  const curves = shownSystems().filter((system) => system.curves[metric]);
  const largest = Math.max(...curves.flatMap((system) => system.curves[metric]), 0);
  const top = largest > 0.5 ? 1 : largest > 0.1 ? 0.5 : largest > 0.01 ? 0.1 : 0.01;
  const bottom = VIEW.height - VIEW.bottom;
  const up = (value) => bottom - ((bottom - VIEW.top) * value) / top;
  const picture = drawing("svg", {
    width: VIEW.width, height: VIEW.height, role: "img",
    "aria-label": `${metric} of the shown systems over time`,
  });
  for (const share of [0, 0.5, 1]) {
    const y = up(share * top);
    picture.append(
      drawing("line", { class: "axis", x1: VIEW.left, x2: VIEW.width - VIEW.right, y1: y, y2: y }),
      drawing("text", { x: VIEW.left - 6, y: y + 4, "text-anchor": "end" }, String(share * top)));
  }
  const { first, framerate } = page.section;
  for (let second = Math.ceil(first / framerate); second * framerate < first + frames; second += 1) {
    const x = across(second * framerate - first);
    picture.append(drawing("text", { x, y: bottom + 18, "text-anchor": "middle" }, `${second} s`));
  }
  // As in the figures: the widest lines first, so that the others lie upon them.
  const width = (system) => lookOf(system.label).width;
  for (const system of curves.sort((one, two) => width(two) - width(one))) {
    const curve = system.curves[metric];
    const late = frames - curve.length; // the last value belongs to the last frame
    const points = curve.map((value, k) => `${across(k + late).toFixed(1)},${up(value).toFixed(1)}`);
    const line = drawing("polyline", { points: points.join(" "), ...strokeOf(system.label) });
    line.append(drawing("title", {}, system.label));
    picture.append(line);
  }
  picture.append(drawing("line", { class: "cursor", y1: VIEW.top, y2: bottom }));
  picture.addEventListener("click", (event) => {
    const box = picture.getBoundingClientRect();
    const x = ((event.clientX - box.left) * VIEW.width) / box.width;
    const span = VIEW.width - VIEW.left - VIEW.right;
    stop();
    seek(((x - VIEW.left) / span) * (frames - 1));
  });
  fill("curve", picture);
}

function step(by) {
  const { samples } = page.section;
  const place = samples.indexOf(document.getElementById("choose-sample").value);
  loadSample(samples[(place + by + samples.length) % samples.length], 0);
}

window.addEventListener("resize", () => {
  if (state.sample === null) return;
  drawCurves();
  showFrame();
});
document.getElementById("before").addEventListener("click", () => step(-1));
document.getElementById("after").addEventListener("click", () => step(1));
document.getElementById("choose-sample").addEventListener("change", (event) =>
  loadSample(event.target.value, 0));
document.getElementById("choose-metric").addEventListener("change", () => {
  drawCurves();
  showFrame();
});
document.getElementById("play").addEventListener("click", () =>
  (state.started === null ? play() : stop()));
document.getElementById("scrub").addEventListener("input", (event) => {
  stop();
  seek(Number(event.target.value));
});
