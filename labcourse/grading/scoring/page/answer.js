// The page of an answer that was opened by name: its keys, and what they do.

const own = () => card.querySelector(".own");

const sendOwn = (name, more) => {
  act(name, { answers: picks([own()]), remark: field("remark").value, ...more });
};

const give = (points) => {
  if (field("remark").value.trim()) return sendOwn("decide", { points });
  field("remark").focus();
  say("Write a remark first: it says to the student why.", true);
};

const givePart = () => {
  const points = typedPoints();
  if (points !== null) give(points);
};

const same = () => {
  if (field("same")) decide("same", { key: own().dataset.key, seen: own().dataset.seen });
  else say("There are no answers here to which you can give the same.", true);
};

const tickAll = () => {
  const on = ticked().length > 0;
  for (const one of all(".tick")) one.checked = !on;
};

const DONE_BY = {
  full: () => give(Number(own().dataset.full)),
  part: givePart,
  note: () => sendOwn("note"),
  same,
  undo: () => act("back", { key: own().dataset.key }),
};

const KEYS = {
  r: () => field("remark").focus(),
  f: DONE_BY.full,
  p: toPoints,
  n: DONE_BY.note,
  s: same,
  x: tickAll,
  u: DONE_BY.undo,
  c: () => field("class").click(),
  o: () => field("overview").click(),
  h: () => help.showModal(),
};

document.addEventListener("keydown", (event) => {
  const { key, target } = event;
  if (help.open || event.altKey || event.metaKey || event.isComposing) return;
  if (target.matches("textarea, input:not([type=checkbox])")) {
    if (key === "Escape" || (key === "Enter" && event.ctrlKey)) back();
    else if (key === "Enter" && target.id === "points") givePart();
    else return;
  } else if (event.ctrlKey || event.repeat || !(key in KEYS)) return;
  else KEYS[key]();
  event.preventDefault();
});

card.addEventListener("click", (event) => DONE_BY[event.target.closest("button")?.id]?.());

watch();
