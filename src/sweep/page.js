"use strict";
const table = document.getElementById("cells");
const body = table.tBodies[0];
const rows = [...body.rows];
const number = (text) => (text === "" ? Infinity : Number(text));
table.tHead.rows[0].querySelectorAll("button").forEach((button, column) => {
  button.addEventListener("click", () => {
    const up = button.parentElement.getAttribute("aria-sort") !== "ascending";
    table.tHead.rows[0].querySelectorAll("th").forEach((head) => head.removeAttribute("aria-sort"));
    button.parentElement.setAttribute("aria-sort", up ? "ascending" : "descending");
    const value = (row) => row.cells[column].dataset.v;
    const numeric = rows.every((row) => !Number.isNaN(number(value(row))));
    const order = (a, b) => (numeric ? number(value(a)) - number(value(b)) : value(a).localeCompare(value(b)));
    rows.sort((a, b) => (up ? order(a, b) : order(b, a)));
    body.append(...rows);
  });
});
document.getElementById("filter").addEventListener("input", (event) => {
  const asked = event.target.value.toLowerCase();
  rows.forEach((row) => { row.hidden = !row.textContent.toLowerCase().includes(asked); });
});
