// Exchange the token of the address for a cookie. It is sent in a header, so that it stands in no log and no referrer.
// Pages send it with each act. They find it in this origin's storage, which pages at other ports of the host cannot read.

const message = document.getElementById("message");

const enter = async () => {
  const token = location.hash.slice(1);
  try {
    const reply = await fetch("enter", { method: "POST", headers: { "X-Labcourse-Token": token } });
    if (reply.ok) {
      localStorage.setItem("labcourse-token", token);
      location.replace("./");
    } else message.textContent = (await reply.json()).problem;
  } catch (error) {
    message.textContent = error instanceof DOMException
      ? "This browser stores nothing for this page. Allow cookies for it, then open your address again."
      : "The scoring program does not answer. Open your address again later, or tell the instructor.";
  }
};

addEventListener("hashchange", enter); // another address in the same tab loads nothing anew
enter();
