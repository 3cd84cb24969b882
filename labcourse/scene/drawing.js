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
const LEAST_INNER = 40; // px
const FONT = "12px ui-sans-serif, system-ui, sans-serif";

function plot(view, pen, panel, box, seen) {
  pen.font = FONT;
  const lines = legendOf(pen, panel, box);
  const under = panel.xlabel ? 36 : 8;
  if (box.height - under - 16 * lines.length < LEAST_INNER) lines.length = 1; // rather the curves than their names
  const above = 10 + 16 * lines.length;
  const inner = { left: box.left + 52, top: box.top + above, width: box.width - 66, height: box.height - above - under };
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
      else if (!down && panel.xlabel) pen.fillText(tick.text, at, inner.top + inner.height + 4);
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
  if (panel.xlabel) pen.fillText(panel.xlabel, inner.left + inner.width / 2, inner.top + inner.height + 34);
  pen.textAlign = "left";
  pen.fillText(panel.ylabel, box.left + 6, box.top + 20);
  legend(view, pen, lines, inner.top - 6);
  for (const handle of panel.handles ?? []) { seen.add(handle.name); view.handles.place(handle, scales, inner); }
}

function legendOf(pen, panel, box) { // lines of entries, each with its place: to the right, below each other where there is too little room
  const beside = box.left + 6 + pen.measureText(panel.ylabel).width + 14;
  const right = box.left + box.width - 14;
  const entries = [...panel.items, ...(panel.handles ?? []).map((handle) => ({ ...handle, kind: "mark", label: handle.legend }))];
  const lines = [];
  let [line, left] = [[], beside];
  for (const item of entries) {
    if (!item.label) continue;
    const wide = 28 + pen.measureText(item.label).width;
    if (left + wide > right && (line.length || !lines.length)) {
      lines.push(line);
      [line, left] = [[], box.left + 6];
    }
    line.push({ item, left });
    left += wide + 14;
    line.end = left - 14;
  }
  lines.push(line);
  for (const one of lines) for (const entry of one) entry.left += Math.max(0, right - one.end);
  return lines;
}

function legend(view, pen, lines, bottom) {
  pen.textAlign = "left";
  pen.textBaseline = "bottom";
  lines.forEach((line, i) => {
    const y = bottom - 16 * (lines.length - 1 - i);
    for (const { item, left } of line) {
      pen.fillStyle = view.color("--text");
      pen.fillText(item.label, left + 28, y);
      if (["mark", "points"].includes(item.kind)) ITEMS.glyph(view, pen, item, left + 14, y - 6);
      else if (item.kind === "line" || item.kind === "level") { ink(view, pen, item); segment(pen, left, y - 6, left + 23, y - 6); }
      else { pen.globalAlpha = item.opacity ?? 0.3; pen.fillStyle = view.color(ROLES[item.role].color); pen.fillRect(left + 2, y - 11, 21, 10); pen.globalAlpha = 1; }
      pen.setLineDash([]);
    }
  });
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
    if (item.shape === "cursor" || item.shape === "dot") { pen.fillStyle = pen.strokeStyle; pen.fill(); } else pen.stroke();
  },
  points(view, pen, item, { X, Y }) {
    const [xs, ys] = [view.slice(item.x), view.slice(item.y)];
    for (let i = 0; i < xs.length; i++) ITEMS.glyph(view, pen, item, X(xs[i]), Y(ys[i]));
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
