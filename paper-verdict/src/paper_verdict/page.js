"use strict"; // a link to an item or an erratum opens the parts that hold it
function visit() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
  if (target) target.scrollIntoView();
}
window.addEventListener("hashchange", visit);
window.addEventListener("load", () => setTimeout(visit));
