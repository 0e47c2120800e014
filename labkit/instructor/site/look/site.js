// What scrolls by itself must be in reach of the keyboard.
function reach() {
  for (const part of document.querySelectorAll("article pre, article .math, article .table-wrapper")) {
    if (part.scrollWidth > part.clientWidth) part.tabIndex = 0;
  }
}
addEventListener("load", reach);
addEventListener("resize", reach);
addEventListener("toggle", reach, true); // of what unfolds
