const el = (name, attributes = {}, ...children) => {
    const node =
        document.createElementNS([ "svg", "g", "path", "line", "text", "title", "circle", "polyline" ].includes(name)
                                     ? "http://www.w3.org/2000/svg"
                                     : "http://www.w3.org/1999/xhtml",
                                 name);
    for (const [key, value] of Object.entries(attributes))
        node.setAttribute(key, value);
    node.append(...children);
    return node;
};
const shown = (value, digits, none = "–") =>
    value === null || value === undefined || !Number.isFinite(value)
        ? none
        : value.toLocaleString("en", {maximumFractionDigits : digits, minimumFractionDigits : digits > 3 ? 0 : digits});
const headed = (...titles) => el("thead", {}, el("tr", {}, ...titles.map(t => el("th", {scope : "col"}, t))));
const rowOf = (...cells) => el("tr", {}, ...cells.map(c => el("td", {}, c)));
const missing = value => value === null || value === undefined || Number.isNaN(value);
// -1, 0 or 1; not a difference, which is no number between infinities
const order = (a, b) => typeof a === "string" ? a.localeCompare(b) : Number(a > b) - Number(a < b);
// A table whose headings sort it. columns: [key, title, text of a row's cell, class]; the first column is words.
// Rows without a value stay below the others, whichever way.
const sortable = (caption, columns, rows, attributes = {}) => {
    const body = el("tbody"), head = el("tr");
    const fill = sorted => body.replaceChildren(...sorted.map(
        r => el("tr", {}, ...columns.map(([, , text, kind ]) => el("td", kind ? {class : kind} : {}, text(r))))));
    const sortBy = (key, cell) => {
        const up = cell.getAttribute("aria-sort") !== "ascending";
        for (const other of head.children)
            other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", up ? "ascending" : "descending");
        fill([...rows ].sort((a, b) => missing(a[key]) - missing(b[key]) || (up ? 1 : -1) * order(a[key], b[key])));
    };
    for (const [key, title, , kind] of columns) {
        const cell = el("th", {scope : "col", "data-key" : key, ...(kind ? {class : kind} : {})}),
              button = el("button", {type : "button"}, title);
        button.addEventListener("click", () => sortBy(key, cell));
        cell.append(button);
        head.append(cell);
    }
    fill(rows);
    return el("div", {class : "scroll"},
              el("table", attributes, el("caption", {}, caption), el("thead", {}, head), body));
};
