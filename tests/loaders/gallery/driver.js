// Uses the gallery as a person does, by keys and clicks, and tells what it sees.
"use strict";

const PATIENCE = 20000; // ms
const found = {};

const soon = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

async function until(what, condition) {
  const end = performance.now() + PATIENCE;
  while (!condition()) {
    if (performance.now() > end) throw new Error(`waited in vain for ${what}`);
    await soon(20);
  }
}

function press(key) {
  const target = byName("detail").open ? byName("detail") : document.activeElement;
  target.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
}

function type(text) {
  byName("search").value = text;
  byName("search").dispatchEvent(new Event("input", { bubbles: true }));
}

const shownIds = () => gallery.shown.map(({ id }) => id);
const names = () => [...document.querySelectorAll(".card")].map((card) => card.getAttribute("aria-label").split(":")[0]);
const value = (facet, text) => document.querySelector(`.facet[data-key=${facet}] button[value=${text}]`);
const ready = () => player.clips.length && player.clips.every((clip) => clip.readyState >= 2 && !clip.seeking);

async function filters() {
  await until("the list", () => names().length);
  await until("posters", () => [...document.querySelectorAll(".card img")].every((img) => img.naturalWidth > 0));
  found.all = names();
  found.count = byName("count").value;
  value("split", "test").click();
  found.test = names();
  found.address = location.hash;
  found.others = value("split", "train").querySelector(".number").textContent;
  value("split", "test").click();
  value("material", "sand").click();
  found.sand = names();
  value("kind", "child").click();
  found.sandChildren = names();
  document.querySelector("#chosen button").click();
  document.querySelector("#chosen button").click();
  found.cleared = names().length;
  byName("least").value = "0.3";
  byName("least").dispatchEvent(new Event("input"));
  found.moving = shownIds();
  type("p0002");
  await until("the search", () => asked.text === "p0002" && gallery.words);
  found.searched = shownIds();
  clearAll();
  type("gravity change");
  await until("the words", () => asked.text === "gravity change");
  found.words = shownIds();
  type("nothing like it");
  await until("no samples", () => !byName("none").hidden);
  byName("clear").click();
  found.again = names().length;
}

async function keys() {
  press("/");
  found.searches = document.activeElement.id;
  press("Enter");
  press("ArrowRight");
  found.second = document.activeElement.getAttribute("aria-label").split(":")[0];
  press("ArrowLeft");
  press("End");
  found.last = document.activeElement.getAttribute("aria-label").split(":")[0];
  press("Home");
  press(" ");
  await until("a preview in the list", () => list.preview && list.preview.currentTime > 0);
  press(" ");
  found.previews = document.querySelectorAll(".card video").length;
  press("ArrowRight");
  press("Enter");
  await until("the sample", () => detail.sample && ready());
  found.opened = [detail.id, isOpen()];
}

async function plays() {
  if (!player.playing) press(" ");
  const before = player.time;
  await until("time to pass", () => player.time > before + 0.5 && player.clips[0].currentTime > 0.3);
  press(" ");
  found.paused = !player.playing && player.clips[0].paused;
  seek(1.5);
  press(".");
  found.time = byName("time").value;
  found.timed = new URLSearchParams(location.hash.slice(1)).get("t");
  byName("tab-scene").click();
  found.scene = byName("panel").querySelector("code").textContent;
  found.keys = byName("panel").querySelectorAll(".t-key").length;
  byName("tab-program").click();
  found.program = byName("panel").querySelector("code").textContent;
  found.keywords = byName("panel").querySelectorAll(".t-keyword").length;
  byName("tab-changes").click();
  found.removed = [...byName("panel").querySelectorAll("del")].map((part) => part.textContent);
  found.added = [...byName("panel").querySelectorAll("ins")].map((part) => part.textContent);
  byName("tab-about").click();
  found.lineage = [...document.querySelectorAll(".lineage .thumb")].map((thumb) => thumb.textContent);
  found.exact = byName("panel").querySelector("a[download]").getAttribute("href");
  press("ArrowRight");
  await until("the next sample", () => detail.id === "p0000-c0-n00" && detail.sample && ready());
  found.title = document.title;
}

async function compares() {
  byName("beside-root").click();
  await until("the other", () => detail.other && player.clips.length === 2 && ready());
  found.beside = [detail.id, detail.beside];
  if (!player.playing) press(" ");
  await until("both to play", () => player.time > 0.8 && player.clips.every((clip) => clip.currentTime > 0.5));
  found.apart = Math.abs(player.clips[0].currentTime - player.clips[1].currentTime);
  press(" ");
  byName("alone").click();
  await until("one alone", () => player.clips.length === 1);
  press("Escape");
  await until("the list again", () => !isOpen());
  found.focused = document.activeElement.getAttribute("aria-label").split(":")[0];
  location.hash = "#id=p0002&t=2.5";
  await until("what the address says", () => detail.id === "p0002" && detail.sample && ready());
  await until("its time", () => Math.abs(player.clips[0].currentTime - 2.5) < 0.3);
  found.linked = [player.time, player.playing];
  history.back();
  await until("the list by going back", () => !isOpen());
}

async function drive() {
  const [, port] = /port=(\d+)/.exec(location.search);
  addEventListener("error", (event) => { found.error ??= event.message; });
  try {
    for (const act of [filters, keys, plays, compares]) await act();
  } catch (error) {
    found.error ??= String(error);
  }
  await fetch(`http://127.0.0.1:${port}/report`, { method: "POST", mode: "no-cors", body: JSON.stringify(found) });
}

drive();
