"use strict";
const { document: report, pictures, scale } = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);

/* Helpers */

const source = (name) => (pictures[name].startsWith("data:") ? pictures[name] : source(pictures[name]));
const count = (n) => n.toLocaleString("en");
const plural = (n, noun) => `${count(n)} ${noun}${n === 1 ? "" : "s"}`;
const percent = (part) => (part > 0 && part < 0.0005 ? "< 0.1 %" : `${(100 * part).toFixed(part > 0 && part < 0.1 ? 1 : 0)} %`);
const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};
const time = (ms) => (ms < 9.95 ? `${ms.toFixed(1)} ms` : ms < 9999.5 ? `${ms.toFixed(0)} ms` : `${(ms / 1e3).toFixed(1)} s`);
const memory = (bytes) => {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  const power = Math.min(units.length - 1, Math.floor(Math.log2(Math.max(bytes, 1)) / 10));
  return `${(bytes / 1024 ** power).toFixed(power ? 1 : 0)} ${units[power]}`;
};
const rgba = ({ srgb, alpha }) => {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(srgb.slice(at, at + 2), 16));
  return `rgb(${r} ${g} ${b} / ${alpha})`;
};

/** Pixels of a picture, by name, once it is decoded. */
const decoded = new Map();
const pixelsOf = (name) => {
  if (!decoded.has(name)) {
    decoded.set(name, (async () => {
      const image = new Image();
      image.src = source(name);
      await image.decode();
      const canvas = element("canvas", { width: image.width, height: image.height });
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.drawImage(image, 0, 0);
      return { canvas, color: (x, y) => "#" + [...context.getImageData(x, y, 1, 1).data.slice(0, 3)].map((c) => c.toString(16).padStart(2, "0")).join("") };
    })());
  }
  return decoded.get(name);
};

/* Heading */

const entries = report.techniques;
const reference = `reference (${report.reference.technique})`;
$("facts").textContent = [
  report.resolve, `${report.width} × ${report.height} pixels`, plural(report.triangles, "triangle"), plural(report.fragments, "fragment"),
  ...(report.fragments ? [`at most ${plural(report.max_depth_complexity, "layer")} behind a pixel`] : []), `held against the ${report.reference.technique === "cpu" ? "CPU renderer" : "oracle"}`,
].join(" · ");
for (const entry of entries) {
  let [kind, verdict] = ["", `differs at ${plural(entry.differing, "pixel")}`];
  if (entry.differing === 0) [kind, verdict] = ["good", "equal to the reference"];
  else if (entry.exact && entry.agrees) [kind, verdict] = ["good", "agrees within the contract"];
  else if (entry.exact && entry.agrees === false) [kind, verdict] = ["bad", `${plural(entry.unexplained, "unexplained pixel")}`];
  $("verdicts").append(element("li", { className: kind }, element("b", { textContent: entry.name }), ` ${verdict}`));
}

/* Side by side */

const choices = [
  ...entries.map((entry) => [entry.name, entry.picture]),
  [reference, report.reference.picture],
  ...entries.map((entry) => [`error of ${entry.name}`, entry.error_map]),
  ["depth complexity", report.pictures.complexity],
];
for (const side of ["left", "right"]) {
  $(side).append(...choices.map(([label, value]) => element("option", { textContent: label, value })));
  $(side).addEventListener("change", showSides);
}
const inexact = entries.find((entry) => !entry.exact) ?? entries[0];
$("left").value = inexact.picture;
$("right").value = report.reference.picture;
function showSides() {
  for (const side of ["left", "right"]) {
    const label = $(side).selectedOptions[0].textContent;
    $(`image-${side}`).src = source($(side).value);
    $(`image-${side}`).alt = label;
    $(`tag-${side}`).textContent = label;
  }
}
showSides();
$("swap").addEventListener("click", () => {
  [$("left").value, $("right").value] = [$("right").value, $("left").value];
  showSides();
});
const viewer = $("viewer");
// All of it fits the window, and small pictures show their pixels.
viewer.style.maxWidth = `calc(88vh * ${report.width / report.height})`;
document.body.classList.toggle("small", report.width < 500);
$("slider").addEventListener("input", (event) => viewer.style.setProperty("--split", `${event.target.value}%`));
new ResizeObserver(() => viewer.classList.toggle("enlarged", viewer.clientWidth * devicePixelRatio > report.width)).observe(viewer);
const pixelAt = (event) => {
  const box = viewer.getBoundingClientRect();
  const along = (at, size, pixels) => Math.max(0, Math.min(pixels - 1, Math.floor((at / size) * pixels)));
  return [along(event.clientX - box.left, box.width, report.width), along(event.clientY - box.top, box.height, report.height)];
};
viewer.addEventListener("pointermove", async (event) => {
  const [x, y] = pixelAt(event);
  const [left, right] = await Promise.all([pixelsOf($("left").value), pixelsOf($("right").value)]);
  $("readout").textContent = `pixel ${x}, ${y} · left ${left.color(x, y)} · right ${right.color(x, y)}`;
});
viewer.addEventListener("dblclick", (event) => {
  const [x, y] = pixelAt(event);
  look({ kind: "chosen", x, y, technique: entries.find((entry) => entry.picture === $("left").value)?.name ?? null });
  $("closer").scrollIntoView({ behavior: "smooth" });
});

/* Figures */

const columns = [
  ["time", (e) => e.total_ms !== null && time(e.total_ms)],
  ["memory", (e) => e.peak_bytes !== null && memory(e.peak_bytes)],
  ["fragments", (e) => e.fragments !== null && count(e.fragments)],
  ["max error", (e) => `${e.max_error}/255`],
  ["PSNR", (e) => (e.psnr === null ? "∞" : e.psnr.toFixed(2))],
  ["SSIM", (e) => e.ssim !== null && e.ssim.toFixed(4)],
  ["FLIP", (e) => e.flip.toFixed(4)],
  ["differing", (e) => count(e.differing)],
  ["ambiguous", (e) => e.ambiguous !== null && count(e.ambiguous)],
  ["unexplained", (e) => e.unexplained !== null && count(e.unexplained)],
];
const heading = element("tr", {}, ...["technique", ...columns.map(([name]) => name)].map((name) => element("th", { scope: "col", textContent: name })));
const rows = entries.map((entry) => {
  const cells = columns.map(([name, of]) => {
    const text = of(entry);
    const judged = name === "unexplained" && text !== false && entry.exact ? (entry.unexplained ? "bad" : "good") : "";
    return element("td", { textContent: text || "–", className: text === false ? "none" : judged });
  });
  return element("tr", { title: entry.device ?? "blended in draw order from the reference's layers" }, element("th", { scope: "row", textContent: entry.name }), ...cells);
});
$("table").append(element("thead", {}, heading), element("tbody", {}, ...rows));

/* A closer look */

/** Pixels shown beside, and above, the one looked at. */
const REACH = [10, 7];
const titles = { worst: (spot) => `worst of ${spot.technique}`, deepest: () => "deepest pixel", chosen: (spot) => `pixel ${spot.x}, ${spot.y}` };
for (const spot of report.spots) {
  const button = element("button", { type: "button", textContent: titles[spot.kind](spot) });
  button.spot = spot;
  button.addEventListener("click", () => look(spot));
  $("spots").append(button);
}
async function pane(label, name, { x, y }) {
  const [wide, high] = REACH.map((reach) => 2 * reach + 1);
  const zoom = 24;
  const canvas = element("canvas", { width: wide * zoom, height: high * zoom, role: "img", ariaLabel: `${label}, around pixel ${x}, ${y}` });
  const { canvas: picture, color } = await pixelsOf(name);
  const context = canvas.getContext("2d");
  context.imageSmoothingEnabled = false;
  context.drawImage(picture, x - REACH[0], y - REACH[1], wide, high, 0, 0, canvas.width, canvas.height);
  for (const [outset, style] of [[3, "#000"], [1.5, "#fff"]]) {
    context.lineWidth = 1.5;
    context.strokeStyle = style;
    context.strokeRect(REACH[0] * zoom - outset, REACH[1] * zoom - outset, zoom + 2 * outset, zoom + 2 * outset);
  }
  return element("figure", {}, canvas, element("figcaption", {}, label, element("code", { textContent: color(x, y) })));
}
async function look(spot) {
  for (const button of $("spots").children) button.setAttribute("aria-pressed", button.spot === spot);
  const shown = spot.technique === null ? [] : entries.filter((entry) => entry.name === spot.technique);
  const others = shown.length ? shown : entries;
  const panes = [
    pane(reference, report.reference.picture, spot),
    ...others.map((entry) => pane(entry.name, entry.picture, spot)),
    ...shown.map((entry) => pane(`error of ${entry.name}`, entry.error_map, spot)),
  ];
  $("panes").replaceChildren(...(await Promise.all(panes)));
  $("behind").replaceChildren(...(spot.fragments ? behind(spot) : [element("p", { className: "note", textContent: `Pixel ${spot.x}, ${spot.y}. What lies behind it is listed for the pixels named above.` })]));
}
function behind(spot) {
  const { fragments } = spot;
  const left = fragments.length ? fragments.at(-1).transmittance : 1;
  const backdrop = spot.opaque ? spot.opaque.color : spot.background;
  let before = 1;
  const path = element("div", { className: "path", role: "img", ariaLabel: "Share of each layer in the pixel, nearest first" });
  for (const fragment of fragments) {
    const share = before - fragment.transmittance;
    before = fragment.transmittance;
    const part = element("span", { title: `primitive ${fragment.primitive}: ${percent(share)}` });
    part.style.cssText = `flex: ${share} 0 0; background: ${fragment.color.srgb}`;
    path.append(part);
  }
  const rest = element("span", { title: `behind everything: ${percent(left)}` });
  rest.style.cssText = `flex: ${left} 0 0; background: ${rgba(backdrop)}`;
  path.append(rest);

  const swatch = (color, text) => {
    const made = element("span", { className: "swatch" });
    made.style.background = color;
    return element("td", {}, made, element("code", { textContent: text }));
  };
  const number = (value) => (value === null ? "∞" : Number(value.toPrecision(6)).toString());
  const names = ["layer", "primitive", "depth", "distance", "colour", "alpha", "accumulated", "light left"];
  const head = element("tr", {}, ...names.map((name) => element("th", { scope: "col", textContent: name })));
  const rows = fragments.map((fragment, i) => {
    const meter = element("span", { className: "meter", ariaHidden: "true" }, element("span"));
    meter.firstChild.style.width = `${100 * fragment.transmittance}%`;
    const cells = [fragment.primitive, number(fragment.depth), number(fragment.distance)].map((text) => element("td", { textContent: text }));
    return element("tr", {}, element("td", { textContent: i + 1 }), ...cells, swatch(fragment.color.srgb, fragment.color.srgb), element("td", { textContent: fragment.color.alpha.toFixed(3) }),
      swatch(rgba(fragment.accumulated), fragment.accumulated.srgb), element("td", {}, percent(fragment.transmittance), meter));
  });
  const unlisted = spot.depth_complexity - fragments.length;
  const shown = spot.shown ? ` ${spot.technique} shows ${spot.shown.srgb}, exact is ${spot.expected.srgb}.` : ` It shows ${spot.expected.srgb}.`;
  const words = `Pixel ${spot.x}, ${spot.y}: ${plural(spot.depth_complexity, "layer")} before ${spot.opaque ? "an opaque surface" : "the background"}, of which ${percent(left)} shows through.${shown}`;
  const parts = [element("p", { className: "note", textContent: words }), path];
  if (rows.length) {
    const table = element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows));
    parts.push(element("div", { className: "scroll", tabIndex: 0, role: "region", ariaLabel: "Fragments in depth order" }, table));
  }
  if (unlisted > 0) parts.push(element("p", { className: "note", textContent: `${plural(unlisted, "more layer")} behind these.` }));
  return parts;
}
if (report.spots.length) look(report.spots[0]);
else $("closer").closest("section").hidden = true;

/* Depth complexity */

$("complexity-image").src = source(report.pictures.complexity);
const bins = scale.length;
const greatest = report.depth_complexity.length - 1;
const sums = new Array(bins).fill(0);
report.depth_complexity.forEach((pixels, layers) => (sums[Math.ceil((layers * (bins - 1)) / Math.max(greatest, 1))] += pixels));
const most = Math.max(1, ...sums.slice(1));
const bars = sums.slice(1).map((pixels, i) => {
  const bar = element("span", { title: `${bins - 1 === greatest ? plural(i + 1, "layer") : `about ${count(Math.round(((i + 1) * greatest) / (bins - 1)))} layers`}: ${plural(pixels, "pixel")}` });
  bar.style.cssText = `height: ${(100 * pixels) / most}%; background: ${scale[i + 1]}`;
  return bar;
});
const all = report.width * report.height;
$("histogram").append(...bars);
$("histogram").ariaLabel = `Pixels by number of layers, from 1 to ${greatest}`;
$("histogram-caption").append(
  element("span", { textContent: "1 layer" }),
  element("span", { textContent: `${percent(1 - report.depth_complexity[0] / all)} of the pixels have layers, ${report.mean_depth_complexity.toFixed(1)} on average` }),
  element("span", { textContent: plural(greatest, "layer") }),
);
if (greatest === 0) $("complexity").closest("section").hidden = true;

/* Layers */

const last = report.layers.length - 1;
for (const { number, pixels } of report.layers) {
  const picture = element("div", { role: "img", ariaLabel: `layer ${number}` });
  picture.style.cssText = `aspect-ratio: ${report.width} / ${report.height}; background-size: ${100 * (last + 1)}% 100%; background-position: ${last ? (100 * (number - 1)) / last : 0}% 0`;
  picture.style.backgroundImage = `url("${source(report.pictures.layers)}")`;
  $("strip").append(element("figure", {}, picture, element("figcaption", {}, element("b", { textContent: `layer ${number}` }), ` ${percent(pixels / all)} of the pixels`)));
}
if (last < 0) $("strip").closest("section").hidden = true;

$("colophon").textContent = `Made by pellucid ${report.version}. The figures are in compare.json (schema ${report.schema}) and compare.csv, the pictures beside this page.`;
