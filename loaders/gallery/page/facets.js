// Filters that are statistics, too: each value with its count and a bar.
"use strict";

const BINS = 24; // of the histogram of motion

// A facet in which all samples are alike says nothing.
function makeFacets() {
  const made = FACETS.filter((facet) => gallery.values[facet.key].length > 1).map((facet) => {
    const buttons = gallery.values[facet.key].map((value) => {
      const button = element("button", { type: "button", className: "value", value },
        element("i", { className: "bar" }),
        element("span", {}, spaced(value)),
        element("span", { className: "number" }));
      button.addEventListener("click", () => {
        const chosen = asked.sets[facet.key];
        chosen[chosen.has(value) ? "delete" : "add"](value);
        refresh();
      });
      return button;
    });
    const group = element("div", { className: "facet", role: "group", ariaLabel: facet.title },
      element("h2", {}, facet.title), ...buttons);
    group.dataset.key = facet.key;
    return group;
  });
  if (gallery.motions.most > 0) made.push(makeMotion());
  byName("facets").replaceChildren(...made);
}

function makeMotion() {
  const most = gallery.motions.most;
  const range = (label, value) => element("input", {
    type: "range", min: "0", max: String(most), step: "0.01", value: String(value), ariaLabel: label,
  });
  const [low, high] = [range("least motion", 0), range("most motion", most)];
  low.id = "least";
  high.id = "most";
  const change = () => {
    const [a, b] = [Number(low.value), Number(high.value)].sort((x, y) => x - y);
    asked.motion = a <= 0 && b >= most ? null : [a, b];
    refresh();
  };
  for (const input of [low, high]) input.addEventListener("input", change);
  return element("div", { className: "facet", role: "group", ariaLabel: "Motion" },
    element("h2", { title: "part of the foreground that changes in a second after the prefix" },
      "Motion ", element("output", { id: "motion" })),
    element("div", { id: "histogram", ariaHidden: "true" }),
    element("div", { className: "range" }, low, high),
    element("p", { className: "hint", id: "unknown" }));
}

function drawFacets({ counts, motions }) {
  for (const group of byName("facets").querySelectorAll(".facet[data-key]")) {
    const { key } = group.dataset;
    const most = Math.max(1, ...counts[key].values());
    for (const button of group.querySelectorAll("button")) {
      const count = counts[key].get(button.value) || 0;
      button.setAttribute("aria-pressed", String(asked.sets[key].has(button.value)));
      button.classList.toggle("empty", count === 0);
      button.querySelector(".number").textContent = count.toLocaleString("en");
      button.querySelector(".bar").style.width = `${(100 * count) / most}%`;
    }
  }
  if (byName("histogram")) drawMotion(motions);
}

function drawMotion(motions) {
  const most = gallery.motions.most;
  const bins = new Array(BINS).fill(0);
  for (const motion of motions) bins[Math.min(BINS - 1, Math.floor((BINS * motion) / most))] += 1;
  const highest = Math.max(1, ...bins);
  const [low, high] = asked.motion || [0, most];
  byName("histogram").replaceChildren(...bins.map((count, k) => {
    const middle = ((k + 0.5) * most) / BINS;
    const bar = element("i", { className: middle >= low && middle <= high ? "" : "out" });
    bar.style.height = count ? `${Math.max(4, (100 * count) / highest)}%` : "0";
    return bar;
  }));
  byName("motion").value = `${low.toFixed(2)}–${high.toFixed(2)}`;
  byName("least").value = String(low);
  byName("most").value = String(high);
  const { unknown } = gallery.motions;
  byName("unknown").textContent = unknown ? `not measured for ${unknown.toLocaleString("en")} samples` : "";
}

// What is chosen, each with a button that takes it back.
function drawChosen() {
  const button = (text, undo) => {
    const made = element("button", { type: "button", className: "chip", ariaLabel: `without ${text}` }, `${text} ✕`);
    made.addEventListener("click", () => { undo(); refresh(); });
    return made;
  };
  const made = FACETS.flatMap(({ key }) => [...asked.sets[key]].map((value) =>
    button(key === "objects" ? `${value} objects` : spaced(value), () => asked.sets[key].delete(value))));
  if (asked.motion) made.push(button(`motion ${asked.motion.map((m) => m.toFixed(2)).join("–")}`, () => { asked.motion = null; }));
  if (asked.text) made.push(button(`“${asked.text}”`, () => { asked.text = ""; byName("search").value = ""; }));
  byName("chosen").replaceChildren(...made);
}

function clearAll() {
  for (const { key } of FACETS) asked.sets[key].clear();
  asked.motion = null;
  asked.text = "";
  byName("search").value = "";
  refresh();
}
