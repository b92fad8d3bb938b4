// One sample: its clips, what is told of it, where it comes from.
"use strict";

const detail = { id: "", beside: "", tab: "about", sample: null, other: null };

const TABS = { about: renderAbout, scene: renderScene, program: renderProgram, changes: renderChangesTab };

function isOpen() {
  return byName("detail").open;
}

async function openDetail({ id, beside, time }) {
  const fresh = id !== detail.id || beside !== detail.beside || !isOpen();
  if (!fresh) {
    if (time !== null) seek(time);
    return;
  }
  const goesOn = time === null ? moves() : player.playing;
  Object.assign(detail, { id, beside, sample: null, other: null });
  const dialog = byName("detail");
  if (!dialog.open) dialog.showModal();
  document.documentElement.classList.add("open");
  player.time = time ?? 0;
  setClips(beside ? [id, beside] : [id]);
  drawTrack();
  drawHead();
  byName("panel").replaceChildren();
  byName("body").scrollTop = 0;
  try {
    const [sample, other] = await Promise.all([loadSample(id), beside ? loadSample(beside) : null]);
    if (detail.id !== id || detail.beside !== beside) return; // another was opened meanwhile
    Object.assign(detail, { sample, other });
    player.rate = Math.min(15, sample.framerate);
    drawTime();
    showTab(detail.tab);
  } catch (error) {
    byName("panel").replaceChildren(element("p", { className: "hint", role: "alert" }, error.message));
  }
  if (goesOn) play();
}

function closeDetail() {
  pause();
  detail.id = "";
  document.documentElement.classList.remove("open");
  if (isOpen()) byName("detail").close();
  byName("clips").replaceChildren();
  player.clips = [];
}

function drawHead() {
  const { id, beside } = detail;
  byName("name").textContent = beside ? `${id} beside ${beside}` : id;
  document.title = `${byName("name").textContent} · MPMWorlds gallery`;
  const place = gallery.shown.indexOf(gallery.byId.get(id));
  byName("before").disabled = place <= 0;
  byName("after").disabled = place < 0 || place >= gallery.shown.length - 1;
  const alone = gallery.rows.length < 2;
  for (const name of ["before", "after"]) byName(name).hidden = alone;
  byName("beside").closest("label").hidden = alone;
  byName("beside").value = beside;
  byName("alone").hidden = !beside;
  const root = ancestor(id);
  byName("beside-root").hidden = !root || root === beside;
  byName("beside-root").textContent = root === madeFrom(id) ? `its parent, ${root}` : `its ancestor, ${root}`;
}

function showTab(name) {
  detail.tab = name;
  for (const tab of document.querySelectorAll("[role=tab]")) {
    const chosen = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", String(chosen));
    tab.tabIndex = chosen ? 0 : -1;
  }
  const panel = byName("panel");
  panel.setAttribute("aria-labelledby", `tab-${name}`);
  if (detail.sample) panel.replaceChildren(...TABS[name](detail.sample));
}

function renderAbout(sample) {
  const row = gallery.byId.get(sample.id);
  const facts = [
    ["kind", row.kind], ["split", spaced(row.split)], ["edit", editOf(sample)],
    ["materials", row.materials.map(spaced).join(", ")],
    ["objects", `${row.objects}: ${row.types.map(spaced).join(", ")}`],
    ["motion", row.motion === null ? "" : row.motion.toFixed(3)],
    ["video", `${sample.num_frames} frames, ${sample.framerate} a second, ${sample.resolution} × ${sample.resolution}`],
    ["preview", `256 pixels, ${player.rate} frames a second, lossy: for looking at`],
  ];
  const list = element("dl", {});
  for (const [name, value] of facts) {
    if (value) list.append(element("dt", {}, name), element("dd", {}, value));
  }
  if (sample.exact) {
    const size = `${(sample.exact / 1e6).toFixed(2)} MB`;
    const link = element("a", { href: `videos/${sample.id}.mp4`, download: `${sample.id}.mp4` }, "exact video");
    list.append(element("dt", {}, "download"),
      element("dd", {}, link, ` (${size}; lossless H.264 4:4:4: plays in Chromium, Firefox and OpenCV)`));
  }
  list.append(element("dt", {}, "SHA-256"), element("dd", {}, element("code", { className: "sum" }, sample.frames_sha256), " of frames"));
  return [...renderLineage(sample, row), list, ...renderCeiling(sample.ceiling)];
}

// The edit as it is recorded, in a line.
function editOf(sample) {
  if (!sample.edit) return "";
  const { operator, ...others } = JSON.parse(sample.edit);
  const text = (value) => (typeof value === "string" ? spaced(value) : JSON.stringify(value).replaceAll('"', "").replaceAll(",", ", "));
  const told = Object.entries(others).map(([name, value]) => `${spaced(name)} ${text(value)}`);
  return [spaced(operator), ...told].join("; ");
}

function thumbnail(id, text = id) {
  const row = gallery.byId.get(id);
  if (!row) return element("span", { className: "thumb absent", title: "not in this gallery" }, text);
  const picture = element("img", { src: `previews/${id}.png`, alt: "", loading: "lazy", width: 256, height: 256 });
  const thumb = element("a", { className: "thumb", href: addressOf({ id }) }, picture, text);
  if (id === detail.id) thumb.setAttribute("aria-current", "page");
  return thumb;
}

// Seeds -> parent -> child -> perturbation, and what is made from this one.
function renderLineage(sample, row) {
  const chain = [];
  for (let id = sample.id; id; id = madeFrom(id)) chain.unshift(id);
  const seeds = (sample.seeds || []).filter((seed) => !chain.includes(seed.split("_")[0]));
  const steps = chain.map((id) => element("li", {}, thumbnail(id)));
  if (seeds.length) {
    steps.unshift(element("li", {}, ...seeds.map((seed) => thumbnail(seed.split("_")[0], spaced(seed)))));
  }
  const found = [];
  if (steps.length > 1) {
    found.push(element("h3", {}, "Lineage"), element("ol", { className: "lineage" }, ...steps));
  }
  const group = (title, rows) => {
    if (rows.length) found.push(element("h3", {}, title), element("div", { className: "thumbs" }, ...rows.map(({ id }) => thumbnail(id))));
  };
  group("Made from this", gallery.made.get(row.id) || []);
  group("Of the same parent", (gallery.made.get(row.parent) || []).filter((other) => other !== row));
  return found;
}

// Ids say their lineage.
function madeFrom(id) {
  return gallery.byId.get(id)?.parent ?? (/^[ps]\d+-/.test(id) ? id.slice(0, id.lastIndexOf("-")) : "");
}

// The nearest sample that this one descends from and that is here.
function ancestor(id) {
  let found = madeFrom(id);
  while (found && !gallery.byId.has(found)) found = madeFrom(found);
  return found;
}

function renderCeiling(ceiling) {
  if (!ceiling) return [];
  const rows = Object.entries(ceiling).map(([name, value]) => element("tr", {},
    element("th", { scope: "row" }, name), element("td", {}, value === null ? "–" : value.toFixed(4))));
  return [element("details", {},
    element("summary", {}, "Noise ceiling: each metric between this and runs displaced by a millionth"),
    element("table", {}, ...rows))];
}

function renderCode(sample, text, language, name) {
  const copy = element("button", { type: "button" }, "Copy");
  copy.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text);
      copy.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(byName("panel").querySelector("code"));
      copy.textContent = "Selected: press Ctrl-C";
    }
  });
  const type = language === "python" ? "text/x-python" : "application/yaml";
  const link = element("a", { href: `data:${type};charset=utf-8,${encodeURIComponent(text)}`, download: name }, `Save ${name}`);
  return [element("p", { className: "controls" }, copy, link), codeBlock(text, language)];
}

function renderScene(sample) {
  return renderCode(sample, sample.scene, "yaml", `${sample.id}.yaml`);
}

function renderProgram(sample) {
  return renderCode(sample, sample.program, "python", `${sample.id}.py`);
}

function renderChangesTab(sample) {
  const { other } = detail;
  const { parent } = gallery.byId.get(sample.id);
  const [from, scene] = other ? [other.id, other.scene] : [parent, sample.parent];
  if (!scene) {
    const text = parent
      ? `The scene of ${parent}, which this was made from, is not in the release.`
      : "This was made from no other scene. Choose another sample beside it to see how they differ.";
    return [element("p", { className: "hint" }, text)];
  }
  const edit = editOf(sample);
  const what = element("p", {}, "From ", element("b", {}, from), " to ", element("b", {}, sample.id), other || !edit ? "" : `: ${edit}`);
  return [what, renderChanges(scene, sample.scene)];
}

for (const tab of document.querySelectorAll("[role=tab]")) {
  tab.addEventListener("click", () => showTab(tab.id.slice(4)));
}
