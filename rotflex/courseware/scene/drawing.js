// What is drawn on the canvas: plots with their curves. A view (explorer.js) has the scene's numbers, its colours, and the
// handles that stand on the plots.

const ROLES = {
  measured: { color: "--measured", width: 1.8 },
  model: { color: "--model", width: 2, dash: [9, 3, 2, 3] },
  voltage: { color: "--voltage", width: 1.6 },
  reference: { color: "--reference", width: 1.2, dash: [6, 3] },
  highlight: { color: "--highlight", width: 2, dash: [2, 3] },
  ghost: { color: "--ghost", width: 1.4, dash: [3, 4] },
  grid: { color: "--grid", width: 1 },
  axis: { color: "--reference", width: 1 },
  text: { color: "--text", width: 1.2 },
  body: { color: "--body", width: 1.2 },
};
const FONT = "12px ui-sans-serif, system-ui, sans-serif";

function plot(view, pen, panel, box, seen) {
  const inner = { left: box.left + 52, top: box.top + 26, width: box.width - 66, height: box.height - 26 - (panel.xlabel ? 40 : 12) };
  if (inner.width < 20 || inner.height < 20) return;
  let [x0, x1] = panel.x;
  let [y0, y1] = panel.y;
  if (panel.equal) { // a unit is as long in both directions: show more of one of them
    const unit = Math.max((x1 - x0) / inner.width, (y1 - y0) / inner.height);
    const more = unit * inner.width - (x1 - x0);
    x0 -= more;
    const middle = (y0 + y1) / 2;
    [y0, y1] = [middle - (unit * inner.height) / 2, middle + (unit * inner.height) / 2];
  }
  const X = (x) => inner.left + ((x - x0) / (x1 - x0)) * inner.width;
  const Y = (y) => inner.top + inner.height - ((y - y0) / (y1 - y0)) * inner.height;
  const scales = { X, Y, x: (px) => x0 + ((px - inner.left) / inner.width) * (x1 - x0), y: (px) => y0 + ((inner.top + inner.height - px) / inner.height) * (y1 - y0) };
  pen.font = FONT;
  pen.lineWidth = 1;
  pen.strokeStyle = view.color("--grid");
  pen.fillStyle = view.color("--text");
  for (const [low, high, place, down, count] of [[x0, x1, X, false, inner.width / 75], [y0, y1, Y, true, Math.max(4, inner.height / 30)]]) {
    for (const tick of ticks(low, high, Math.max(2, count))) {
      const at = place(tick.value);
      pen.beginPath();
      if (down) { pen.moveTo(inner.left, at); pen.lineTo(inner.left + inner.width, at); }
      else { pen.moveTo(at, inner.top); pen.lineTo(at, inner.top + inner.height); }
      if (!panel.bare) pen.stroke();
      pen.textAlign = down ? "right" : "center";
      pen.textBaseline = down ? "middle" : "top";
      if (down && at > inner.top + 4) pen.fillText(tick.text, inner.left - 6, at);
      else if (!down && panel.xlabel) pen.fillText(tick.text, at, inner.top + inner.height + 5);
    }
  }
  pen.save();
  pen.beginPath();
  pen.rect(inner.left, inner.top, inner.width, inner.height);
  pen.clip();
  for (const item of panel.items) ITEMS[item.kind](view, pen, item, scales, inner);
  pen.restore();
  pen.strokeStyle = view.color("--text");
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(inner.left, inner.top);
  pen.lineTo(inner.left, inner.top + inner.height);
  pen.lineTo(inner.left + inner.width, inner.top + inner.height);
  pen.stroke();
  pen.fillStyle = view.color("--text");
  pen.textBaseline = "bottom";
  pen.textAlign = "center";
  if (panel.xlabel) pen.fillText(panel.xlabel, inner.left + inner.width / 2, inner.top + inner.height + 38);
  pen.textAlign = "left";
  pen.fillText(panel.ylabel, box.left + 6, inner.top - 6);
  legend(view, pen, panel, inner, box.left + 6 + pen.measureText(panel.ylabel).width + 14);
  for (const handle of panel.handles ?? []) { seen.add(handle.name); view.placeHandle(handle, scales, inner); }
}

function legend(view, pen, panel, inner, from) {
  let right = inner.left + inner.width;
  for (const item of panel.items) { // the first stands rightmost, and is kept where there is little room
    if (!item.label) continue;
    const wide = pen.measureText(item.label).width;
    right -= wide;
    if (right - 28 < from) return;
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    pen.fillStyle = view.color("--text");
    pen.fillText(item.label, right, inner.top - 6);
    const y = inner.top - 12;
    if (item.kind === "mark") ITEMS.glyph(view, pen, item, right - 14, y);
    else if (item.kind === "line" || item.kind === "level") { ink(view, pen, item); segment(pen, right - 28, y, right - 5, y); }
    else { pen.globalAlpha = item.opacity ?? 0.3; pen.fillStyle = view.color(ROLES[item.role].color); pen.fillRect(right - 26, y - 5, 21, 10); pen.globalAlpha = 1; }
    pen.setLineDash([]);
    right -= 42;
  }
}

function ink(view, pen, item) {
  const role = ROLES[item.role];
  pen.strokeStyle = view.color(role.color);
  pen.lineWidth = item.width ?? role.width;
  pen.setLineDash(item.dash ?? role.dash ?? []);
  pen.lineJoin = "round";
}

// --- what is drawn in a plot ----------------------------------------------------------------------------------------

const ITEMS = {
  line(view, pen, item, { X, Y }) {
    const [xs, ys] = [view.slice(item.x), view.slice(item.y)];
    ink(view, pen, item);
    pen.beginPath();
    for (let i = 0; i < xs.length; i++) pen.lineTo(X(xs[i]), Y(ys[i]));
    pen.stroke();
    pen.setLineDash([]);
  },
  area(view, pen, item, { X, Y }) {
    const [xs, ys] = [view.slice(item.x), view.slice(item.y)];
    pen.globalAlpha = item.opacity ?? 0.3;
    pen.fillStyle = view.color(ROLES[item.role].color);
    pen.beginPath();
    for (let i = 0; i < xs.length; i++) pen.lineTo(X(xs[i]), Y(ys[i]));
    pen.fill();
    pen.globalAlpha = 1;
  },
  band(view, pen, item, { X, Y }, inner) {
    pen.globalAlpha = item.opacity ?? 0.3;
    pen.fillStyle = view.color(ROLES[item.role].color);
    const [from, to] = item.span;
    if (item.axis === "y") pen.fillRect(inner.left, Y(to), inner.width, Y(from) - Y(to));
    else pen.fillRect(X(from), inner.top, X(to) - X(from), inner.height);
    pen.globalAlpha = 1;
  },
  level(view, pen, item, { X, Y }, inner) {
    const at = item.clock && view.cursor != null ? view.cursor : item.at;
    ink(view, pen, item);
    if (item.axis === "y") segment(pen, inner.left, Y(at), inner.left + inner.width, Y(at));
    else segment(pen, X(at), inner.top, X(at), inner.top + inner.height);
    pen.setLineDash([]);
  },
  text(view, pen, item, { X, Y }) {
    pen.fillStyle = view.color("--faint");
    pen.textAlign = item.anchor ?? "center";
    pen.textBaseline = "middle";
    pen.fillText(item.text, X(item.at[0]), Y(item.at[1]));
  },
  mark(view, pen, item, { X, Y }) {
    ITEMS.glyph(view, pen, item, X(item.at[0]), Y(item.at[1]));
  },
  glyph(view, pen, item, x, y) {
    ink(view, pen, { ...item, width: 2, dash: [] });
    const r = item.size ?? 5;
    if (item.shape === "cross") { segment(pen, x - r, y - r, x + r, y + r); segment(pen, x - r, y + r, x + r, y - r); return; }
    pen.beginPath();
    if (item.shape === "square") pen.rect(x - r, y - r, 2 * r, 2 * r);
    else pen.arc(x, y, r, 0, 2 * Math.PI);
    pen.stroke();
  },
};

function segment(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) {
    found.push({ value: i * step, text: (i * step).toFixed(digits).replace("-", "−") });
  }
  return found;
}
