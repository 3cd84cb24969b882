// The scoring page: keys, acts, and the card that comes back. Every act is written by the server before the next card.

const place = document.getElementById("scoring");
const card = document.getElementById("card");
const message = document.getElementById("message");
const help = document.getElementById("help");
const task = { question: place.dataset.question, part: place.dataset.part };
const RENEWED = 40_000; // ms; an answer is held three times as long
let busy = false;
let unseen = new Set();
let watcher = null;

const say = (words, trouble = false) => {
  message.textContent = words;
  message.classList.toggle("trouble", trouble);
};

const send = async (act, more = {}, options = {}) => {
  const reply = await fetch(`act/${act}`, {
    method: "POST",
    headers: { "Content-Type": "application/json", "X-Labcourse-Page": document.body.dataset.page },
    body: JSON.stringify({ ...task, ...more }),
    ...options,
  });
  const content = await reply.json().catch(() => { throw new TypeError(); }); // a proxy's own page
  if (!reply.ok) throw new Error(content.problem);
  return content;
};

const all = (selector) => [...card.querySelectorAll(selector)];
const answers = () => all(".answer");
const ticked = () => answers().filter((one) => one.querySelector(".tick").checked);
const field = (name) => document.getElementById(name);

// --- what is shown ---------------------------------------------------------------------------------------------------

const show = (reply) => {
  card.innerHTML = reply.html; // the server's own; all that is a student's in it is escaped there
  field("state").innerHTML = reply.state;
  card.setAttribute("aria-busy", "false");
  say(reply.message, reply.trouble);
  card.querySelector("[data-first]")?.focus({ preventScroll: true });
  watch();
};

// An answer that is scored together with another has to have been in view to its end.
const watch = () => {
  watcher?.disconnect();
  const others = answers().slice(1);
  unseen = new Set(others);
  watcher = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (entry.isIntersecting) unseen.delete(entry.target.closest(".answer"));
      }
    },
    { root: card.querySelector(".answers") },
  );
  for (const one of others) watcher.observe(one.querySelector(".end"));
};

const unreadAmong = (chosen) => {
  const missed = chosen.find((one) => unseen.has(one));
  if (!missed) return false;
  missed.querySelector(".end").scrollIntoView({ block: "end" });
  say(`${missed.getAttribute("aria-label")} had not been in view. Here it is; press the key once more.`, true);
  return true;
};

const act = async (name, more) => {
  if (busy) return; // a key for the next answer must not come before it is seen
  busy = true;
  card.setAttribute("aria-busy", "true");
  try {
    show(await send(name, more));
  } catch (error) {
    const gone = error instanceof TypeError;
    say(gone ? "The scoring program does not answer. What was scored before is kept; whether this one is, you see when the program runs again. Then open your address again. On the computer where you started the command score, start it once more and open the address that it prints." : error.message, true);
    card.setAttribute("aria-busy", "false");
  }
  busy = false;
};

const picks = (chosen) => chosen.map((one) => ({ key: one.dataset.key, seen: one.dataset.seen }));

const decide = (name, more) => {
  const chosen = ticked();
  if (!chosen.length) {
    say("No answer is ticked: x ticks all again.", true);
    return;
  }
  if (unreadAmong(chosen)) return;
  const shown = answers().map((one) => one.dataset.key);
  act(name, { answers: picks(chosen), shown, remark: field("remark")?.value ?? "", ...more });
};

// --- what is done ----------------------------------------------------------------------------------------------------

const give = (level) => decide("give", { level });

const givePoints = () => {
  const typed = field("points").value.trim().replace(",", ".");
  const points = Number(typed);
  if (!typed || !Number.isFinite(points)) {
    say("Points are a number, as 0.5.", true);
    return;
  }
  decide("give", { points });
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
const back = () => card.querySelector("[data-first]")?.focus();

const KEYS = {
  r: () => field("remark").focus(),
  p: () => {
    field("points").focus();
    field("points").select(); // what is there from before is typed over
  },
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

field("help-button").addEventListener("click", () => help.showModal());
field("help-close").addEventListener("click", () => help.close());

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
