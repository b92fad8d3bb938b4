// The samples, which of them are shown, and what is loaded of each when it is asked for.
"use strict";

const gallery = {
  rows: [], // all samples, in the order of the index
  byId: new Map(),
  made: new Map(), // id -> rows that are made from it
  shown: [], // rows that pass the filter, in the order that is chosen
  words: null, // words of all scenes, once one has searched
  values: {}, // of each facet, those that occur
  motions: { most: 0, unknown: 0 },
};

// What is asked for: of each facet a set of values; a range of motion; a text.
const asked = { sets: {}, motion: null, text: "", order: "id" };

// `any`: a sample has one value, and may have any that is chosen. Otherwise it has
// several, and must have all that are chosen.
const FACETS = [
  { key: "split", title: "Split", any: true, of: (row) => [row.split] },
  { key: "kind", title: "Kind", any: true, of: (row) => [row.kind] },
  { key: "material", title: "Material", any: false, of: (row) => row.materials },
  { key: "object", title: "Object type", any: false, of: (row) => row.types },
  { key: "objects", title: "Objects", any: true, of: (row) => [String(row.objects)] },
];

const ORDERS = {
  id: () => 0, // as they come
  motion: (a, b) => (b.motion ?? -1) - (a.motion ?? -1),
  still: (a, b) => (a.motion ?? Infinity) - (b.motion ?? Infinity) || 0,
  objects: (a, b) => b.objects - a.objects,
};

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function byName(id) {
  return document.getElementById(id);
}

function spaced(text) {
  return text.replaceAll("_", " ");
}

function readIndex(index) {
  gallery.rows = index.rows.map(([id, parent, kind, split, materials, types, objects, motion], place) => ({
    id, parent, objects, motion, place,
    kind: index.kinds[kind],
    split: index.splits[split],
    materials: materials.map((n) => index.materials[n]),
    types: types.map((n) => index.types[n]),
  }));
  for (const row of gallery.rows) {
    gallery.byId.set(row.id, row);
    if (!row.parent) continue;
    if (!gallery.made.has(row.parent)) gallery.made.set(row.parent, []);
    gallery.made.get(row.parent).push(row);
  }
  for (const { key, of } of FACETS) {
    asked.sets[key] = new Set();
    const found = new Set();
    for (const row of gallery.rows) for (const value of of(row)) found.add(value);
    found.delete("");
    gallery.values[key] = [...found].sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
  }
  for (const { motion } of gallery.rows) {
    if (motion === null) gallery.motions.unknown += 1;
    else gallery.motions.most = Math.max(gallery.motions.most, Math.ceil(motion * 20) / 20);
  }
}

function passesFacet(row, facet) {
  const chosen = asked.sets[facet.key];
  if (!chosen.size) return true;
  const values = facet.of(row);
  if (facet.any) return values.some((value) => chosen.has(value));
  return [...chosen].every((value) => values.includes(value));
}

function passesMotion(row) {
  if (asked.motion === null) return true;
  const [low, high] = asked.motion;
  return row.motion !== null && row.motion >= low && row.motion <= high;
}

// A sample has each term in its id, or as part of a word of its scene or edit.
function textTest() {
  const terms = asked.text.toLowerCase().split(/\s+/).filter(Boolean);
  if (!terms.length) return () => true;
  const found = terms.map((term) => {
    if (gallery.words === null) return new Set();
    const numbers = gallery.words.words.map((word, n) => (word.includes(term) ? n : -1));
    return new Set(numbers.filter((n) => n >= 0));
  });
  return (row) => terms.every((term, k) => row.id.includes(term)
    || (found[k].size && gallery.words.rows[row.place].some((n) => found[k].has(n))));
}

// Choose what is shown; the counts of a facet are those if one more of it were chosen.
function choose() {
  const passesText = textTest();
  const rest = gallery.rows.filter((row) => passesText(row));
  const asking = FACETS.filter(({ key }) => asked.sets[key].size);
  const fails = rest.map((row) => asking.filter((facet) => !passesFacet(row, facet)));
  const moves = rest.map(passesMotion);
  gallery.shown = rest.filter((_, k) => moves[k] && !fails[k].length);
  if (asked.order !== "id") gallery.shown.sort(ORDERS[asked.order]);
  const counts = {};
  for (const facet of FACETS) {
    const count = new Map();
    rest.forEach((row, k) => {
      const others = fails[k].some((other) => other !== facet || !facet.any);
      if (others || !moves[k]) return;
      for (const value of facet.of(row)) count.set(value, (count.get(value) || 0) + 1);
    });
    counts[facet.key] = count;
  }
  const motions = rest.filter((row, k) => !fails[k].length && row.motion !== null);
  return { counts, motions: motions.map((row) => row.motion) };
}

// What is loaded is a script, which a page may load from a disk.
const waiting = new Map();
const loaded = new Map(); // the last few samples
const KEPT = 30;

function loadScript(path) {
  return new Promise((resolve, reject) => {
    const script = element("script", { src: path });
    script.onload = () => { script.remove(); resolve(); };
    script.onerror = () => { script.remove(); reject(new Error(`${path} is missing: write the gallery again`)); };
    document.head.append(script);
  });
}

async function loadSample(id) {
  if (!loaded.has(id)) {
    if (!waiting.has(id)) {
      waiting.set(id, loadScript(`samples/${id}.js`).finally(() => waiting.delete(id)));
    }
    await waiting.get(id);
  }
  return loaded.get(id);
}

function onSample(sample) {
  loaded.set(sample.id, sample);
  if (loaded.size > KEPT) loaded.delete(loaded.keys().next().value);
}

let words = null;

function loadWords() {
  words ??= loadScript("words.js");
  return words;
}

function onWords(some) {
  gallery.words = some;
}
