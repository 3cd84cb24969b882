// What is wider than its place is scrolled; with the focus in it, by the arrow keys as well.
"use strict";
const WIDE = "pre, .table-wrapper, div.math, div.cell_output, mjx-container[display=true]";
function reachable() {
  for (const one of document.querySelectorAll(WIDE)) {
    if (one.scrollWidth > one.clientWidth + 1) one.tabIndex = 0;
    else if (one.tabIndex === 0) one.removeAttribute("tabindex");
  }
}
addEventListener("load", reachable);
addEventListener("resize", reachable);
for (const one of document.querySelectorAll("details")) one.addEventListener("toggle", reachable);
