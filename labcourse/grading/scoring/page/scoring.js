// The scoring page: its keys, and what they do.

const RENEWED = 40_000; // ms; an answer is held three times as long

// --- what is done ----------------------------------------------------------------------------------------------------

const give = (level) => decide("give", { level });

const givePoints = () => {
  const points = typedPoints();
  if (points !== null) decide("give", { points });
};

const ask = () => decide("ask", {});

const use = (key) => {
  const chosen = card.querySelector(`[data-use="${key}"] span`);
  if (!chosen) {
    say(`There is no remark ${key} here.`, true);
    return;
  }
  const lines = field("remark").value.split("\n").filter(Boolean);
  const at = lines.indexOf(chosen.textContent);
  if (at < 0) lines.push(chosen.textContent);
  else lines.splice(at, 1);
  field("remark").value = lines.join("\n");
};

const tickOthers = () => {
  const [first, ...others] = all(".tick");
  const on = others.some((one) => one.checked);
  first.checked = true;
  for (const one of others) one.checked = !on;
  if (others.length) say(on ? "Only the first is ticked." : "All are ticked.");
  else say("There is only this one answer, and it is ticked.");
};

const skip = () => act("next", { skip: answers()[0].dataset.key });
const KEYS = {
  r: () => field("remark").focus(),
  p: toPoints,
  x: tickOthers,
  s: skip,
  u: () => act("undo"),
  "?": ask,
  h: () => help.showModal(),
  n: () => {
    if (field("after")) field("after").click();
    else say(answers().length ? "This part is not done; o shows all parts." : "No other part waits; o shows all parts.");
  },
  o: () => field("overview").click(),
};

const OF_AN_ANSWER = /^[0-4a-grpxs?]$/; // keys that do something to what is shown

document.addEventListener("keydown", (event) => {
  const { key, target } = event;
  if (help.open || event.altKey || event.metaKey || event.isComposing) return;
  if (target.matches("textarea, input:not([type=checkbox])")) {
    if (key === "Escape" || (key === "Enter" && event.ctrlKey)) back();
    else if (key === "Enter" && target.id === "points") givePoints();
    else return;
    event.preventDefault();
    return;
  }
  if (event.ctrlKey || event.repeat) return; // a key that is held down is pressed once
  if (OF_AN_ANSWER.test(key) && !answers().length) {
    if (!busy) say("There is no answer on this page that this key could be for.", true);
  } else if (/^[0-4]$/.test(key)) give(Number(key));
  else if (/^[a-g]$/.test(key)) use(key);
  else if (key in KEYS) KEYS[key]();
  else return;
  event.preventDefault();
});

card.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (!button) return;
  if (button.dataset.level) give(Number(button.dataset.level));
  else if (button.dataset.use) use(button.dataset.use);
  else ({ ask, skip, undo: () => act("undo") })[button.id]?.();
});

setInterval(async () => {
  const first = answers()[0];
  if (!first || busy) return;
  try {
    const { message: words } = await send("renew", { key: first.dataset.key });
    if (words) say(words, true);
  } catch {
    // The next act says what is wrong.
  }
}, RENEWED);

addEventListener("pagehide", () => {
  send("leave", {}, { keepalive: true }).catch(() => {});
});

act("next", { key: place.dataset.key });
