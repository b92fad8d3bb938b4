// The list: only the cards in sight, and a little around them, are in the page.
"use strict";

const CARD = { narrowest: 168, gap: 14, caption: 52 };
const AROUND = 1; // rows of cards beyond those in sight
const HOVER = 150; // milliseconds before a preview plays

const list = { columns: 1, width: 200, cards: new Map(), place: 0, preview: null, timer: 0 };

function moves() {
  return !matchMedia("(prefers-reduced-motion: reduce)").matches;
}

const BRIEF = { modification_validation: "modif." }; // beside an id there is room for no more

function makeCard(row, place) {
  const picture = element("img", {
    src: `previews/${row.id}.png`, alt: "", decoding: "async", width: 256, height: 256,
  });
  const materials = row.materials.map(spaced).join(", ");
  const card = element("a", {
    className: "card", title: `${row.kind} of ${row.objects} objects`, href: addressOf({ id: row.id }), tabIndex: place === list.place ? 0 : -1,
    ariaLabel: `${row.id}: ${row.kind}${row.split && ` of ${spaced(row.split)}`}, ${materials || "no material"}, ${row.objects} objects`,
  },
  element("span", { className: "picture" }, picture),
  element("span", { className: "caption" },
    element("b", {}, row.id),
    element("span", { title: spaced(row.split) }, BRIEF[row.split] || spaced(row.split)),
    element("small", {}, materials || "colliders only")));
  card.addEventListener("pointerenter", (event) => {
    if (event.pointerType !== "mouse" || !moves()) return;
    clearTimeout(list.timer);
    list.timer = setTimeout(() => playPreview(card, row), HOVER);
  });
  card.addEventListener("pointerleave", () => { clearTimeout(list.timer); stopPreview(); });
  card.addEventListener("focus", () => { list.place = place; });
  const item = element("div", { className: "item" }, card);
  item.setAttribute("role", "listitem");
  item.setAttribute("aria-posinset", place + 1);
  item.setAttribute("aria-setsize", gallery.shown.length);
  return item;
}

function playPreview(card, row) {
  stopPreview();
  const video = element("video", {
    src: `previews/${row.id}.mp4`, muted: true, loop: true, playsInline: true, autoplay: true,
  });
  card.querySelector(".picture").append(video);
  list.preview = video;
}

function stopPreview() {
  list.preview?.remove();
  list.preview = null;
}

function layOut() {
  const home = byName("list");
  const width = home.clientWidth;
  list.columns = Math.max(2, Math.floor((width + CARD.gap) / (CARD.narrowest + CARD.gap)));
  list.width = (width - (list.columns - 1) * CARD.gap) / list.columns;
  const rows = Math.ceil(gallery.shown.length / list.columns);
  home.style.height = `${rows * rowHeight()}px`;
}

function rowHeight() {
  return list.width + CARD.caption + CARD.gap;
}

// Show the cards that are in sight now.
function drawList() {
  const home = byName("list");
  const top = -home.getBoundingClientRect().top;
  const first = Math.max(0, Math.floor(top / rowHeight()) - AROUND) * list.columns;
  const rows = Math.ceil(innerHeight / rowHeight()) + 2 * AROUND + 1;
  const last = Math.min(gallery.shown.length, first + rows * list.columns);
  for (const [place, item] of list.cards) {
    if (place >= first && place < last) continue;
    item.remove();
    list.cards.delete(place);
  }
  const fresh = document.createDocumentFragment();
  for (let place = first; place < last; place += 1) {
    let item = list.cards.get(place);
    if (!item) {
      item = makeCard(gallery.shown[place], place);
      list.cards.set(place, item);
      fresh.append(item);
    }
    const [row, column] = [Math.floor(place / list.columns), place % list.columns];
    item.style.width = `${list.width}px`;
    item.style.transform = `translate(${column * (list.width + CARD.gap)}px, ${row * rowHeight()}px)`;
  }
  home.append(fresh);
}

function resetList() {
  stopPreview();
  for (const item of list.cards.values()) item.remove();
  list.cards.clear();
  list.place = Math.min(list.place, Math.max(0, gallery.shown.length - 1));
  layOut();
  drawList();
}

// Bring a card into sight and give it the focus.
function focusCard(place) {
  const old = list.cards.get(list.place)?.firstElementChild;
  if (old) old.tabIndex = -1;
  list.place = Math.min(Math.max(place, 0), gallery.shown.length - 1);
  const top = byName("list").getBoundingClientRect().top + scrollY
    + Math.floor(list.place / list.columns) * rowHeight();
  const head = byName("top").offsetHeight + CARD.gap;
  if (top - head < scrollY) scrollTo({ top: top - head });
  if (top + rowHeight() > scrollY + innerHeight) scrollTo({ top: top + rowHeight() - innerHeight });
  drawList();
  const card = list.cards.get(list.place)?.firstElementChild;
  if (!card) return;
  card.tabIndex = 0;
  card.focus({ preventScroll: true });
}

function togglePreview() {
  const card = list.cards.get(list.place)?.firstElementChild;
  if (!card) return;
  const playing = list.preview && card.contains(list.preview);
  if (playing) stopPreview();
  else playPreview(card, gallery.shown[list.place]);
}

let drawing = 0;
function drawSoon() {
  if (drawing) return;
  drawing = requestAnimationFrame(() => { drawing = 0; drawList(); });
}

addEventListener("scroll", drawSoon, { passive: true });
addEventListener("resize", () => { layOut(); drawSoon(); });
