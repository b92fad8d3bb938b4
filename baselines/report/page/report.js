// Tables, ranking and figures. `data.js` calls onReport once everything is here.
"use strict";

const DENSE = 10; // columns from which a table is set small
const page = { report: null, section: null };

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function fill(id, ...children) {
  document.getElementById(id).replaceChildren(...children);
}

// A number at the start of a cell; what is none sorts after all that are.
function sortKey(text) {
  const value = parseFloat(text.replace(/^\[/, ""));
  return Number.isNaN(value) ? null : value;
}

function compare(a, b) {
  const [x, y] = [sortKey(a), sortKey(b)];
  if (x === null || y === null) {
    return (x === null) - (y === null) || a.localeCompare(b);
  }
  return x - y;
}

function isMissing(text) {
  return text === "–";
}

// Sort the rows of every group of a table by one column, keeping groups apart.
function sortTable(table, column, descending) {
  for (const body of table.tBodies) {
    const rows = [...body.rows].filter((row) => !row.classList.contains("group"));
    rows.sort((one, two) => {
      const [a, b] = [one, two].map((row) => row.cells[column].textContent);
      if (isMissing(a) || isMissing(b)) return isMissing(a) - isMissing(b);
      return (descending ? -1 : 1) * compare(a, b);
    });
    body.append(...rows);
  }
}

// Long names may be broken after an underscore.
function breakable(text) {
  const parts = text.split(/(?<=_)/);
  return parts.flatMap((part, k) => (k ? [element("wbr"), part] : [part]));
}

// What a cell is: a number, long text; the column that stays in sight.
function cellClass(told, column, text) {
  const classes = [];
  if (column >= told.texts) classes.push("number");
  else if (text.length > 40) classes.push("wide");
  if (column === Math.max(0, told.columns.indexOf("system"))) classes.push("kept");
  return classes.join(" ");
}

function headerCell(told, column) {
  const button = element("button", { type: "button" }, told.columns[column]);
  const className = cellClass(told, column, "");
  const cell = element("th", { scope: "col", className }, button);
  button.addEventListener("click", () => {
    const table = cell.closest("table");
    const descending = cell.getAttribute("aria-sort") === "ascending";
    for (const other of cell.parentElement.cells) other.removeAttribute("aria-sort");
    cell.setAttribute("aria-sort", descending ? "descending" : "ascending");
    sortTable(table, column, descending);
  });
  return cell;
}

function groupBody(told, group) {
  const body = element("tbody");
  if (group.heading) {
    const heading = element("span", {}, group.heading);
    const cell = element("th", { colSpan: told.columns.length }, heading);
    body.append(element("tr", { className: "group" }, cell));
  }
  for (const row of group.rows) {
    const cells = row.map((text, column) =>
      element("td", { className: cellClass(told, column, text) }, ...breakable(text)));
    body.append(element("tr", {}, ...cells));
  }
  return body;
}

function renderTable(told) {
  const head = element("tr", {}, ...told.columns.map((_, k) => headerCell(told, k)));
  const dense = told.columns.length > DENSE ? "dense" : "";
  const table = element("table", { className: dense, ariaLabel: told.title },
    element("thead", {}, head),
    ...told.groups.map((group) => groupBody(told, group)));
  const notes = told.notes.map((note) => element("p", { className: "note" }, note));
  const empty = told.groups.every((group) => group.rows.length === 0);
  const title = element("h3", {}, told.title);
  const shown = empty ? [] : [title, element("div", { className: "scroll" }, table)];
  return element("div", {}, ...shown, ...notes);
}

function renderFigure(figure) {
  const picture = element("img", {
    src: `${figure.path}.svg`, alt: figure.caption, loading: "lazy",
  });
  const shown = element("div", { className: "scroll" }, picture);
  return element("figure", {}, shown, element("figcaption", {}, figure.caption));
}

function showSection(section) {
  page.section = section;
  for (const button of document.getElementById("splits").children) {
    button.setAttribute("aria-pressed", String(button.value === section.key));
  }
  const [ranking, ...tables] = section.tables;
  fill("ranking", renderTable(ranking));
  const choice = document.getElementById("choose-table");
  fill("choose-table", ...tables.map((told, k) =>
    element("option", { value: String(k) }, told.title.replace(`${section.name}, `, ""))));
  choice.onchange = () => fill("table", renderTable(tables[Number(choice.value)]));
  choice.onchange();
  const figures = section.figures.map(renderFigure);
  const none = element("p", { className: "hint" }, "There are no figures.");
  fill("figures", ...(figures.length ? figures : [none]));
  showSamples(section);
}

function onReport(report) {
  page.report = report;
  fill("notes", ...report.notes.map((note) => element("li", {}, note)));
  fill("others", ...report.tables.map(renderTable));
  fill("splits", ...report.sections.map((section) => {
    const button = element("button", { type: "button", value: section.key }, section.name);
    button.addEventListener("click", () => showSection(section));
    return button;
  }));
  const asked = decodeURIComponent(location.hash.slice(1)).split("/")[0];
  const found = report.sections.find((section) => section.key === asked);
  showSection(found || report.sections[0]);
}
