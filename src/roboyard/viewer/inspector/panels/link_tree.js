// A tree of links with buttons for each layer. The body of a function with `say` and `listen` (see PageScript).
  const style = document.createElement("style");
  style.textContent = `
    .roboyard-tree { font-size: 13px; color: var(--mantine-color-text, #222); margin: 0 2px; }
    .roboyard-tree button { border: 0; background: transparent; color: inherit; padding: 0; cursor: pointer; width: 24px;
      height: 22px; border-radius: 4px; flex: 0 0 auto; }
    .roboyard-tree button:hover { background: rgba(38, 96, 164, .18); }
    .roboyard-tree button[aria-pressed=false] { opacity: .3; }
    .roboyard-tree button[aria-pressed=mixed] { opacity: .6; }
    .roboyard-tree :focus-visible { outline: 2px solid #2660a4; outline-offset: -1px; }
    .roboyard-tree svg { width: 15px; height: 15px; display: block; margin: auto; fill: currentColor; }
    .roboyard-list { max-height: min(42vh, 420px); overflow: auto; border: 1px solid
      var(--mantine-color-default-border, #ccc); border-radius: 5px; }
    .roboyard-row { display: flex; align-items: center; height: 23px; cursor: pointer; white-space: nowrap; padding-right: 3px; }
    .roboyard-rows .roboyard-row:hover { background: rgba(128, 128, 128, .15); }
    .roboyard-row[aria-selected=true] { background: rgba(250, 120, 10, .28) !important; }
    .roboyard-row > .name { flex: 1 1 auto; min-width: 40px; overflow: hidden; text-overflow: ellipsis; }
    .roboyard-row > .mass { flex: 0 0 auto; padding: 0 4px; opacity: .75; font-size: 11px; }
    .roboyard-row > .twist { flex: 0 0 16px; text-align: center; font-size: 10px; }
    .roboyard-row > .gap { flex: 0 0 24px; }
    .roboyard-row[data-found=error] > .name { color: #d22; } .roboyard-row[data-found=warning] > .name { color: #b36b00; }
    .roboyard-head { font-size: 12px; cursor: default; position: sticky; top: 0; padding-left: 5px; z-index: 1;
      background: var(--mantine-color-body, #fff); border-bottom: 1px solid var(--mantine-color-default-border, #ccc); }
    .roboyard-fade { display: grid; grid-template-columns: auto 1fr 42px; gap: 2px 8px; align-items: center; margin: 5px 2px 0; }
    .roboyard-fade input { width: 100%; margin: 0; accent-color: #2660a4; }
    .roboyard-fade output { text-align: right; font-size: 12px; font-variant-numeric: tabular-nums; }
    .roboyard-tree label.below { display: flex; gap: 6px; align-items: center; margin: 5px 2px 0; cursor: pointer; }`;
  document.head.appendChild(style);
  const ICONS = [
    "M8 3C4 3 1.500 6.200.5 8c1 1.800 3.500 5 7.500 5s6.500-3.200 7.500-5c-1-1.800-3.500-5-7.500-5zm0 8.500A3.500 3.500 0 1 1 8 4.500a3.500 3.500 0 0 1 0 7zM8 6a2 2 0 1 0 0 4 2 2 0 0 0 0-4z",
    "M8 1L2 4v8l6 3 6-3V4zM8 2.700L12 4.600 8 6.500 4 4.600zM3.300 5.700l4 2v5.600l-4-2zM12.700 5.700v5.600l-4 2V7.700z",
    "M8 1.500a6.500 6.500 0 1 0 0 13 6.500 6.500 0 0 0 0-13zm0 1.300a5.200 5.200 0 0 1 5.100 4.200c-1.200.8-3 1.200-5.100 1.200S4.100 7.800 2.900 7A5.200 5.200 0 0 1 8 2.800z"];
  let state = null, host = null, rows = [], made = "", below = false;
  const closed = new Set();
  const make = (kind, options, ...inner) => {
    const e = Object.assign(document.createElement(kind), options);
    e.append(...inner);
    return e;
  };
  const childrenOf = i => state.links.map((l, k) => l.parent === i ? k : -1).filter(k => k >= 0);
  const toggle = (layer, i, act) => {
    const b = make("button", {type: "button"});
    b.innerHTML = `<svg viewBox="0 0 16 16" aria-hidden="true"><path d="${ICONS[layer]}"/></svg>`;
    b.dataset.layer = layer;
    b.addEventListener("click", e => { e.stopPropagation(); act(b.getAttribute("aria-pressed") !== "true"); if (e.detail > 0) b.blur(); });
    b.tabIndex = i < 0 ? 0 : -1;
    return b;
  };
  const build = () => {
    const tree = make("div", {className: "roboyard-rows"});
    tree.setAttribute("role", "tree");
    tree.setAttribute("aria-label", "Links");
    const head = make("div", {className: "roboyard-row roboyard-head"}, make("span", {className: "name", textContent: state.title}));
    state.layers.forEach((name, layer) => head.append(toggle(layer, -1, on => say(["show", layer, -1, on, false]))));
    rows = state.links.map((link, i) => {
      const row = make("div", {className: "roboyard-row", tabIndex: -1, title: `${link.name}${link.mass && " · " + link.mass}`});
      row.setAttribute("role", "treeitem");
      row.setAttribute("aria-level", link.depth + 1);
      row.setAttribute("aria-label", link.name);
      row.style.paddingLeft = `${8 * Math.min(link.depth, 14)}px`;
      if (link.found) row.dataset.found = link.found;
      const twist = make("span", {className: "twist"});
      twist.addEventListener("click", e => { e.stopPropagation(); fold(i); });
      row.append(twist, make("span", {className: "name", textContent: link.name}), make("span", {className: "mass", textContent: link.mass}));
      state.layers.forEach((name, layer) => row.append(
        toggle(layer, i, on => say(["show", layer, i, on, below])), make("span", {className: "gap"})));
      row.addEventListener("click", () => say(["pick", state.picked === i ? -1 : i]));
      row.addEventListener("keydown", e => onKey(e, i));
      return row;
    });
    tree.append(...rows);
    const box = make("input", {type: "checkbox", checked: below});
    box.addEventListener("change", () => { below = box.checked; });
    const fade = make("div", {className: "roboyard-fade"});
    state.layers.forEach((name, layer) => {
      const input = make("input", {type: "range", min: 5, max: 100, step: 5});
      input.dataset.layer = layer;
      input.setAttribute("aria-label", `opacity of the ${name}`);
      input.addEventListener("input", () => {
        const link = state.picked, opacity = input.value / 100;  // another may be picked before the message goes
        later(`${layer} ${link}`, () => say(["fade", layer, link, opacity, below]));
      });
      fade.append(make("span", {textContent: `${name}:`}), input, make("output", {}));
    });
    host.replaceChildren(make("div", {className: "roboyard-list"}, head, tree), fade, make("label", {className: "below"}, box, "also the links below"));
    host.dataset.made = made;
  };
  let timer = null;
  const due = new Map();
  const later = (key, act) => {  // a dragged slider sends a few values, and its last
    due.set(key, act);
    timer ??= setTimeout(() => { timer = null; for (const each of due.values()) each(); due.clear(); }, 150);
  };
  const fold = i => {
    if (!childrenOf(i).length) return;
    closed.has(state.links[i].name) ? closed.delete(state.links[i].name) : closed.add(state.links[i].name);
    show();
  };
  const isShown = i => {
    for (let up = state.links[i].parent; up >= 0; up = state.links[up].parent) if (closed.has(state.links[up].name)) return false;
    return true;
  };
  const focus = i => {
    rows.forEach((row, k) => { row.tabIndex = k === i ? 0 : -1; });
    rows[i].focus();
  };
  const onKey = (e, i) => {
    const open = rows.map((_, k) => k).filter(isShown), at = open.indexOf(i), link = state.links[i];
    const isOpen = childrenOf(i).length && !closed.has(link.name);
    const layer = "vcs".indexOf(e.key);
    if (e.target !== rows[i] || e.ctrlKey || e.metaKey || e.altKey) return;
    if (e.key === "ArrowDown") focus(open[Math.min(at + 1, open.length - 1)]);
    else if (e.key === "ArrowUp") focus(open[Math.max(at - 1, 0)]);
    else if (e.key === "Home") focus(open[0]);
    else if (e.key === "End") focus(open[open.length - 1]);
    else if (e.key === "ArrowRight") isOpen ? focus(childrenOf(i)[0]) : fold(i);
    else if (e.key === "ArrowLeft") isOpen ? fold(i) : link.parent >= 0 && focus(link.parent);
    else if (e.key === "Enter" || e.key === " ") say(["pick", state.picked === i ? -1 : i]);
    else if (layer >= 0) rows[i].querySelector(`button[data-layer="${layer}"]`).click();
    else return;
    e.preventDefault();
    e.stopPropagation();
  };
  let seen = -1;
  const show = () => {
    const links = JSON.stringify([state.title, state.layers, state.links]);
    if (links !== made || host.dataset.made !== links) { made = links; build(); seen = -1; }
    const i = state.picked;
    if (i >= 0 && i !== seen)
      for (let up = state.links[i].parent; up >= 0; up = state.links[up].parent) closed.delete(state.links[up].name);
    const tabbed = rows.findIndex(row => row.tabIndex === 0 && !row.hidden);
    rows.forEach((row, k) => {
      const inner = childrenOf(k).length, isClosed = closed.has(state.links[k].name);
      row.style.display = isShown(k) ? "" : "none";
      row.setAttribute("aria-selected", k === i);
      if (inner) row.setAttribute("aria-expanded", !isClosed);
      row.querySelector(".twist").textContent = inner ? (isClosed ? "▸" : "▾") : "";
      if (tabbed < 0) row.tabIndex = k === Math.max(i, 0) ? 0 : -1;
      for (const b of row.querySelectorAll("button")) {
        const layer = Number(b.dataset.layer), on = state.shown[layer].includes(k), any = state.has[layer].includes(k);
        b.setAttribute("aria-pressed", on);
        b.title = `${on ? "hide" : "show"} the ${state.layers[layer]} of ${state.links[k].name}`;
        b.setAttribute("aria-label", b.title);
        b.style.display = any ? "" : "none";
        b.nextSibling.style.display = any ? "none" : "";
      }
    });
    for (const b of host.querySelectorAll(".roboyard-head button")) {
      const layer = Number(b.dataset.layer), has = state.has[layer], on = has.filter(k => state.shown[layer].includes(k)).length;
      b.setAttribute("aria-pressed", on === 0 ? "false" : on === has.length ? "true" : "mixed");
      b.title = `the ${state.layers[layer]} of all links`;
      b.setAttribute("aria-label", b.title);
    }
    const fade = host.querySelector(".roboyard-fade");
    fade.style.display = i < 0 ? "none" : "";
    for (const input of fade.querySelectorAll("input")) {
      const value = Math.round(100 * (state.opacity[input.dataset.layer][i] ?? 1));
      if (i >= 0 && document.activeElement !== input) input.value = value;
      input.nextSibling.textContent = `${value} %`;
    }
    if (i !== seen) { seen = i; if (i >= 0) rows[i].scrollIntoView({block: "nearest"}); }
  };
  const find = () => {
    const found = document.querySelector("[data-roboyard-tree]");
    if (!found || !state) { host = null; return; }
    if (found === host && host.dataset.made) return;
    host = found;
    host.classList.add("roboyard-tree");
    show();
  };
  const pulse = setInterval(find, 250);
  listen(now => { state = now; find(); if (host) show(); });
  return () => { clearInterval(pulse); clearTimeout(timer); style.remove(); host?.replaceChildren(); if (host) delete host.dataset.made; };
