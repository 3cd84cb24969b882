// What the pages on which answers are scored have in common: an act, and the card that comes back. Every act is written
// by the server before the next card.

const place = document.getElementById("scoring");
const card = document.getElementById("card");
const message = document.getElementById("message");
const help = document.getElementById("help");
const task = { question: place.dataset.question, part: place.dataset.part };
const token = localStorage.getItem("labcourse-token") ?? ""; // a copy: another scorer's, later, is not this page's
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
    headers: { "Content-Type": "application/json", "X-Labcourse-Token": token },
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
  const ends = all(".answer .end"); // the first answer of a card has none
  unseen = new Set(ends.map((one) => one.closest(".answer")));
  watcher = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (entry.isIntersecting) unseen.delete(entry.target.closest(".answer"));
      }
    },
    { root: card.querySelector(".answers") },
  );
  for (const one of ends) watcher.observe(one);
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

const typedPoints = () => {
  const typed = field("points").value.trim().replace(",", ".");
  if (typed && Number.isFinite(Number(typed))) return Number(typed);
  say("Points are a number, as 0.5.", true);
  return null;
};

const back = () => card.querySelector("[data-first]")?.focus();
const toPoints = () => {
  field("points").focus();
  field("points").select(); // what is there from before is typed over
};

field("help-button").addEventListener("click", () => help.showModal());
field("help-close").addEventListener("click", () => help.close());
