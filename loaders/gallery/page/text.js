// Coloured YAML and Python, and the difference of two texts.
"use strict";

const PYTHON_WORDS = new Set(("and as assert break class continue def del elif else except False finally for "
  + "from global if import in is lambda None nonlocal not or pass raise return True try while with yield").split(" "));

// The first alternative that fits decides.
const GRAMMARS = {
  python: [
    ["comment", /#[^\n]*/],
    ["string", /[rbf]?"""[^]*?"""|[rbf]?"(?:\\.|[^"\\\n])*"|[rbf]?'(?:\\.|[^'\\\n])*'/],
    ["number", /\b\d[\d_]*\.?\d*(?:e[-+]?\d+)?\b/],
    ["mark", /@[\w.]+/],
    ["word", /[A-Za-z_]\w*/],
  ],
  yaml: [
    ["comment", /#[^\n]*/],
    ["string", /"(?:\\.|[^"\\])*"|'[^']*'/],
    ["key", /[A-Za-z_]\w*(?=:(?:\s|$))/],
    ["number", /-?\b\d[\d_]*\.?\d*(?:e[-+]?\d+)?\b/],
    ["word", /[A-Za-z_][\w/.-]*/],
  ],
};

function tokens(text, language) {
  const grammar = GRAMMARS[language];
  const any = new RegExp(grammar.map(([, form]) => `(${form.source})`).join("|"), "g");
  const found = [];
  let end = 0;
  let defines = false;
  for (const match of text.matchAll(any)) {
    if (match.index > end) found.push(["", text.slice(end, match.index)]);
    let [kind] = grammar[match.slice(1).findIndex((part) => part !== undefined)];
    if (kind === "word") {
      const isWord = language === "python" && PYTHON_WORDS.has(match[0]);
      kind = isWord ? "keyword" : defines ? "name" : language === "yaml" ? "value" : "";
      defines = isWord && (match[0] === "def" || match[0] === "class");
    }
    found.push([kind, match[0]]);
    end = match.index + match[0].length;
  }
  found.push(["", text.slice(end)]);
  return found;
}

// A colour of a scene is shown beside its name.
function coloured(text, language) {
  const code = element("code");
  for (const [kind, part] of tokens(text, language)) {
    const color = kind === "string" && /^'(#[0-9A-F]{6})'$/i.exec(part);
    if (color) {
      const dot = element("i", { className: "dot" });
      dot.style.background = color[1];
      code.append(dot);
    }
    code.append(kind ? element("span", { className: `t-${kind}` }, part) : part);
  }
  return code;
}

function codeBlock(text, language) {
  const lines = text.trimEnd().split("\n").length;
  const numbers = Array.from({ length: lines }, (_, k) => k + 1).join("\n");
  return element("pre", { className: "code", tabIndex: 0, ariaLabel: language },
    element("span", { className: "numbers", ariaHidden: "true" }, numbers),
    coloured(text.trimEnd(), language));
}

// Longest common subsequence, as pairs of places; both are a few thousand at most.
function common(one, two) {
  let start = 0;
  while (start < one.length && start < two.length && one[start] === two[start]) start += 1;
  let [endOne, endTwo] = [one.length, two.length];
  while (endOne > start && endTwo > start && one[endOne - 1] === two[endTwo - 1]) { endOne -= 1; endTwo -= 1; }
  const [a, b] = [one.slice(start, endOne), two.slice(start, endTwo)];
  const width = b.length + 1;
  const lengths = new Uint16Array((a.length + 1) * width);
  for (let i = a.length - 1; i >= 0; i -= 1) {
    for (let j = b.length - 1; j >= 0; j -= 1) {
      lengths[i * width + j] = a[i] === b[j]
        ? lengths[(i + 1) * width + j + 1] + 1
        : Math.max(lengths[(i + 1) * width + j], lengths[i * width + j + 1]);
    }
  }
  const pairs = Array.from({ length: start }, (_, k) => [k, k]);
  let [i, j] = [0, 0];
  while (i < a.length && j < b.length) {
    if (a[i] === b[j]) { pairs.push([start + i, start + j]); i += 1; j += 1; }
    else if (lengths[(i + 1) * width + j] >= lengths[i * width + j + 1]) i += 1;
    else j += 1;
  }
  for (let k = 0; k < one.length - endOne; k += 1) pairs.push([endOne + k, endTwo + k]);
  return pairs;
}

// Lines of a scene. Where a line is broken within brackets says nothing.
function parts(scene) {
  const found = [];
  let depth = 0;
  for (const line of scene.trimEnd().split("\n")) {
    if (depth > 0) found[found.length - 1] += ` ${line.trim()}`;
    else found.push(line);
    depth += (line.match(/[[{]/g) || []).length - (line.match(/[\]}]/g) || []).length;
  }
  return found;
}

function lexemes(line) {
  return line.match(/\s+|[\w.'#/-]+|[^\s\w]/g) || [];
}

// Lines of two scenes side by side: kept, changed with its words, removed or added.
function changes(before, after) {
  const shape = (line) => line.replace(/-?\d+(?:\.\d+)?/g, "0");
  const [one, two] = [parts(before), parts(after)];
  const found = [];
  let [i, j] = [0, 0];
  // Lines that differ in numbers alone belong together.
  for (const [p, q] of [...common(one.map(shape), two.map(shape)), [one.length, two.length]]) {
    const [gone, come] = [one.slice(i, p), two.slice(j, q)];
    const key = (line) => /^[- ]*\w+:/.exec(line)?.[0];
    const paired = gone.length === come.length && gone.every((line, k) => key(line) === key(come[k]));
    if (paired) gone.forEach((line, k) => found.push([line, come[k]]));
    else found.push(...gone.map((line) => [line, null]), ...come.map((line) => [null, line]));
    if (p < one.length && q < two.length) found.push([one[p], two[q]]);
    [i, j] = [p + 1, q + 1];
  }
  return found;
}

function changedLine(before, after) {
  const line = element("div", { className: "line" });
  if (before === after) {
    line.append(coloured(after, "yaml"));
    return line;
  }
  if (before === null || after === null) {
    line.classList.add(before === null ? "added" : "removed");
    line.append(element(before === null ? "ins" : "del", {}, before ?? after));
    return line;
  }
  line.classList.add("changed");
  const [one, two] = [lexemes(before), lexemes(after)];
  let [i, j] = [0, 0];
  for (const [p, q] of [...common(one, two), [one.length, two.length]]) {
    if (p > i) line.append(element("del", {}, one.slice(i, p).join("")));
    if (q > j) line.append(element("ins", {}, two.slice(j, q).join("")));
    if (q < two.length) line.append(two[q]);
    [i, j] = [p + 1, q + 1];
  }
  return line;
}

function renderChanges(before, after) {
  const lines = changes(before, after).map(([one, two]) => changedLine(one, two));
  return element("div", { className: "code diff", tabIndex: 0, role: "region", ariaLabel: "changes" }, ...lines);
}
