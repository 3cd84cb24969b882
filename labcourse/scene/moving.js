// A drawing that moves (Moving in scene.py): shapes whose points stand in frames, which signals turn and shift.

function moving(view, pen, panel, box, seen) {
  const signals = { ...panel.signals, ...view.pose };
  const [[x0, x1], [y0, y1], above] = [panel.x, panel.y, 24]; // px, for the readings
  const unit = Math.min(box.width / (x1 - x0), (box.height - above) / (y1 - y0)); // px
  const middle = [box.left + box.width / 2, box.top + above + ((y1 - y0) * unit) / 2];
  const to = ([x, y]) => [middle[0] + (x - (x0 + x1) / 2) * unit, middle[1] - (y - (y0 + y1) / 2) * unit];
  const from = ([px, py]) => [(px - middle[0]) / unit + (x0 + x1) / 2, (middle[1] - py) / unit + (y0 + y1) / 2];
  const place = (point) => to(standing(point, signals));
  pen.font = FONT;
  pen.fillStyle = view.color("--text");
  pen.textAlign = "left";
  pen.textBaseline = "bottom";
  const rounded = (value, digits) => (Number(value.toFixed(digits)) || 0).toFixed(digits); // no "-0.0"
  const read = ({ label, signal, scale, digits, unit: name }) => `${label} ${rounded(signals[signal] * scale, digits)}${name}`;
  pen.fillText(panel.readings.map(read).join("   "), box.left + 6, box.top + 20);
  for (const shape of panel.shapes) {
    SHAPES[shape.kind](view, pen, shape, shape.points.map(place), unit);
    pen.setLineDash([]);
  }
  for (const grab of panel.grabs) {
    seen.add(grab.name);
    const at = place(grab.point);
    const pulled = view.grabs.place(grab, at, to, from);
    if (!pulled) continue;
    ink(view, pen, { role: "highlight" });
    segment(pen, ...at, ...pulled);
    pen.setLineDash([]);
  }
}

function standing({ frame, at }, signals) { // where a point is on the ground: through its frames, the innermost first
  let [x, y] = at;
  for (const { turn, shift, by } of [...frame].reverse()) {
    if (turn !== undefined) {
      const [cos, sin] = [Math.cos(signals[turn]), Math.sin(signals[turn])];
      [x, y] = [x * cos - y * sin, x * sin + y * cos];
    } else {
      const much = by === null ? 1 : signals[by];
      [x, y] = [x + shift[0] * much, y + shift[1] * much];
    }
  }
  return [x, y];
}

const SHAPES = {
  line(view, pen, shape, [start, end]) {
    ink(view, pen, shape.width ? { ...shape, dash: [] } : shape);
    if (shape.width) pen.lineCap = "round";
    segment(pen, ...start, ...end);
    pen.lineCap = "butt";
  },
  rectangle(view, pen, shape, [[x, y], [x1, y1], [x2, y2]]) {
    ink(view, pen, shape);
    pen.fillStyle = view.color(ROLES[shape.fill].color);
    pen.save();
    pen.translate(x, y);
    pen.rotate(Math.atan2(y1 - y, x1 - x));
    pen.beginPath();
    pen.rect(0, 0, Math.hypot(x1 - x, y1 - y), -Math.hypot(x2 - x1, y2 - y1));
    pen.fill();
    pen.stroke();
    pen.restore();
  },
  circle(view, pen, shape, [middle], unit) {
    ink(view, pen, shape);
    pen.beginPath();
    pen.arc(...middle, shape.radius * unit, 0, 2 * Math.PI);
    pen.stroke();
  },
  dot(view, pen, shape, [middle]) {
    pen.fillStyle = view.color(ROLES[shape.role].color);
    pen.beginPath();
    pen.arc(...middle, shape.size, 0, 2 * Math.PI);
    pen.fill();
  },
  spring(view, pen, shape, [start, end]) {
    ink(view, pen, { ...shape, width: 1.5, dash: [] });
    zigzag(pen, ...start, ...end, shape.turns, shape.swing);
  },
};

function zigzag(pen, x0, y0, x1, y1, turns, wide) {
  const [dx, dy] = [(x1 - x0) / (turns + 1), (y1 - y0) / (turns + 1)];
  const long = Math.hypot(dx, dy) || 1;
  pen.beginPath();
  pen.moveTo(x0, y0);
  for (let i = 1; i <= turns; i++) {
    const side = i % 2 ? wide : -wide;
    pen.lineTo(x0 + i * dx - (side * dy) / long, y0 + i * dy + (side * dx) / long);
  }
  pen.lineTo(x1, y1);
  pen.stroke();
}
