(() => {
  const sources = SOURCES;
  const get = (id) => document.getElementById("wiper" + id);
  const box = get(""), at = get("-at");
  const move = () => box.style.setProperty("--at", at.value + "%");
  const show = () => {
    const frame = sources[get("-frame").value];
    get("-a").src = frame[get("-left").value];
    get("-b").src = frame[get("-right").value];
  };
  at.addEventListener("input", move);
  ["-frame", "-left", "-right"].forEach((id) => get(id).addEventListener("change", show));
  move();
})();
