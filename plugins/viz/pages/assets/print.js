// A printed page has all folded sections open.
addEventListener("beforeprint", () => {
  for (const section of document.querySelectorAll("details:not([open])")) {
    section.open = true;
    section.dataset.folded = "";
  }
});
addEventListener("afterprint", () => {
  for (const section of document.querySelectorAll("details[data-folded]")) {
    section.open = false;
    delete section.dataset.folded;
  }
});
