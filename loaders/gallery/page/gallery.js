// The page: its address, its keys, and what happens when something is chosen.
"use strict";

const SLOW = 120; // milliseconds after the last letter of a search

// An address says what is shown: filters, a sample, the one beside it, a time.
function addressOf(changes) {
  const told = new URLSearchParams();
  if (changes.id) told.set("id", changes.id);
  if (changes.beside) told.set("beside", changes.beside);
  if (changes.time !== undefined && changes.time !== null) told.set("t", String(Math.round(changes.time * 100) / 100));
  for (const { key } of FACETS) {
    for (const value of asked.sets[key]) told.append(key, value);
  }
  if (asked.motion) told.set("motion", asked.motion.join("-"));
  if (asked.text) told.set("q", asked.text);
  if (asked.order !== "id") told.set("order", asked.order);
  return `#${told}`;
}

function readAddress() {
  const told = new URLSearchParams(location.hash.slice(1));
  for (const { key } of FACETS) asked.sets[key] = new Set(told.getAll(key));
  const motion = (told.get("motion") || "").split("-").map(Number);
  asked.motion = motion.length === 2 && motion.every(Number.isFinite) ? motion : null;
  asked.text = told.get("q") || "";
  asked.order = told.get("order") in ORDERS ? told.get("order") : "id";
  const time = told.get("t") === null ? null : Number(told.get("t")) || 0;
  return { id: told.get("id") || "", beside: told.get("beside") || "", time };
}

function replaceAddress(address) {
  history.replaceState(null, "", address);
}

function go(changes) {
  location.hash = addressOf(changes);
}

function rememberTime() {
  replaceAddress(addressOf({ id: detail.id, beside: detail.beside, time: player.time }));
}

// Show what is asked for, and say so in the address.
function refresh() {
  show();
  scrollTo({ top: 0 });
  replaceAddress(addressOf(isOpen() ? detail : {}));
}

function show() {
  const found = choose();
  resetList();
  if (!byName("facets").childElementCount) makeFacets();
  drawFacets(found);
  drawChosen();
  const [shown, all] = [gallery.shown.length, gallery.rows.length];
  const numbers = [shown, all].map((number) => number.toLocaleString("en"));
  byName("count").value = shown === all ? `${numbers[1]} samples` : `${numbers[0]} of ${numbers[1]} samples`;
  byName("none").hidden = shown > 0;
  byName("order").value = asked.order;
}

async function search() {
  asked.text = byName("search").value.trim();
  if (asked.text) await loadWords();
  refresh();
}

// What the address says, as when it is opened or one goes back.
async function followAddress() {
  const { id, beside, time } = readAddress();
  byName("search").value = asked.text;
  if (asked.text) await loadWords();
  show();
  const lone = gallery.rows.length === 1 ? gallery.rows[0].id : "";
  const opened = gallery.byId.has(id) ? id : lone;
  if (id && !gallery.byId.has(id)) byName("count").value = `${id} is not in this gallery; ${byName("count").value}`;
  if (opened) await openDetail({ id: opened, beside: gallery.byId.has(beside) ? beside : "", time });
  else {
    closeDetail();
    document.title = "MPMWorlds gallery";
  }
}

function leave() {
  const place = gallery.shown.indexOf(gallery.byId.get(detail.id));
  closeDetail();
  history.pushState(null, "", addressOf({}));
  document.title = "MPMWorlds gallery";
  if (place >= 0) focusCard(place);
}

function neighbour(by) {
  const place = gallery.shown.indexOf(gallery.byId.get(detail.id)) + by;
  if (gallery.shown[place]) go({ id: gallery.shown[place].id });
}

function besideOf(id) {
  if (id === "" || gallery.byId.has(id)) go({ id: detail.id, beside: id, time: player.time });
}

const KEYS_OF_LIST = {
  ArrowRight: () => focusCard(list.place + 1),
  ArrowLeft: () => focusCard(list.place - 1),
  ArrowDown: () => focusCard(list.place + list.columns),
  ArrowUp: () => focusCard(list.place - list.columns),
  Home: () => focusCard(0),
  End: () => focusCard(gallery.shown.length - 1),
  Enter: () => go({ id: gallery.shown[list.place].id }),
  " ": togglePreview,
  "/": () => byName("search").focus(),
};

const KEYS_OF_DETAIL = {
  ArrowRight: () => neighbour(1),
  ArrowLeft: () => neighbour(-1),
  ",": () => step(-1),
  ".": () => step(1),
  " ": toggle,
  Escape: leave,
};

function isTyping(target) {
  return target.matches?.("input[type=search], input[list], select");
}

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const { key, target } = event;
  if (isTyping(target)) {
    if (key === "Escape" && target.id === "search") target.blur();
    if (target.id === "search" && (key === "Enter" || key === "ArrowDown")) {
      event.preventDefault();
      focusCard(0);
    }
    return;
  }
  const presses = (key === " " || key === "Enter") && target.matches?.("button, summary, a:not(.card)");
  const slides = key.startsWith("Arrow") && target.matches?.("input[type=range], [role=tab], pre, .diff");
  const act = (isOpen() ? KEYS_OF_DETAIL : KEYS_OF_LIST)[key];
  if (!act || presses || slides) return;
  event.preventDefault();
  act();
});

// Arrows between tabs, as those who use them by keys expect.
document.querySelector("[role=tablist]").addEventListener("keydown", (event) => {
  const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!by) return;
  const tabs = [...event.currentTarget.children];
  const next = tabs[(tabs.indexOf(event.target) + by + tabs.length) % tabs.length];
  showTab(next.id.slice(4));
  next.focus();
});

function onIndex(index) {
  readIndex(index);
  byName("title").textContent = index.title;
  byName("ids").replaceChildren(...gallery.rows.slice(0, 500).map(({ id }) => element("option", { value: id })));
  followAddress();
}

let typed = 0;
byName("search").addEventListener("input", () => {
  clearTimeout(typed);
  typed = setTimeout(search, SLOW);
});
byName("search").addEventListener("focus", loadWords);
byName("order").addEventListener("change", (event) => { asked.order = event.target.value; refresh(); });
byName("show-facets").addEventListener("click", () => {
  const open = document.body.classList.toggle("with-facets");
  byName("show-facets").setAttribute("aria-expanded", String(open));
  layOut();
  drawList();
});
byName("clear").addEventListener("click", clearAll);
byName("before").addEventListener("click", () => neighbour(-1));
byName("after").addEventListener("click", () => neighbour(1));
byName("close").addEventListener("click", leave);
byName("detail").addEventListener("cancel", (event) => { event.preventDefault(); leave(); });
byName("detail").addEventListener("click", (event) => { if (event.target === byName("detail")) leave(); });
byName("beside").addEventListener("change", (event) => besideOf(event.target.value.trim()));
byName("beside-root").addEventListener("click", () => besideOf(ancestor(detail.id)));
byName("alone").addEventListener("click", () => besideOf(""));
addEventListener("hashchange", followAddress);
