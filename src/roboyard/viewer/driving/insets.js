// Pictures of a robot's sensors in the corner of the scene. The body of a function with `say` and `listen`.
  const box = document.createElement("div"), pictures = document.createElement("div"), chips = document.createElement("div");
  const style = document.createElement("style");
  style.textContent = `
    .roboyard-insets { position: fixed; z-index: 60; display: flex; flex-direction: column; align-items: flex-end; gap: 6px;
      font: 12px/1.3 system-ui, sans-serif; pointer-events: none; }
    .roboyard-insets > div { display: flex; flex-wrap: wrap-reverse; justify-content: flex-end; gap: 6px; }
    .roboyard-insets figure { margin: 0; position: relative; border-radius: 6px; overflow: hidden; background: #222;
      box-shadow: 0 1px 6px rgba(0,0,0,.35); border: 1px solid rgba(255,255,255,.8); }
    .roboyard-insets img { display: block; }
    .roboyard-insets figcaption { position: absolute; left: 0; bottom: 0; padding: 1px 6px; color: #fff; background: rgba(0,0,0,.5); }
    .roboyard-insets button { pointer-events: auto; border: 1px solid rgba(38,96,164,.55); border-radius: 12px; padding: 2px 9px;
      font: inherit; cursor: pointer; color: var(--mantine-color-text, #222); background: var(--mantine-color-body, #fff); opacity: .9; }
    .roboyard-insets button[aria-pressed=true] { background: #2660a4; color: #fff; }
    .roboyard-insets :focus-visible { outline: 2px solid #2660a4; outline-offset: 1px; }`;
  document.head.appendChild(style);
  box.className = "roboyard-insets";
  box.setAttribute("role", "group");
  box.setAttribute("aria-label", "Sensors of the robot");
  box.append(pictures, chips);
  document.body.appendChild(box);
  let listed = "";
  const place = () => {
    const canvas = window.__viserMutable?.canvas?.getBoundingClientRect();
    if (!canvas) return;
    box.style.right = `${innerWidth - canvas.right + 12}px`;
    box.style.bottom = `${innerHeight - canvas.bottom + 12}px`;
    box.style.maxWidth = `${canvas.width < 640 ? Math.max(canvas.width - 280, 130) : canvas.width - 300}px`;
    for (const img of pictures.querySelectorAll("img")) img.width = canvas.width < 640 ? 128 : canvas.width < 1400 ? 170 : 280;
  };
  const watch = new ResizeObserver(place);  // the panel is docked after the page has opened
  let watched = null;
  const follow = () => {
    const canvas = window.__viserMutable?.canvas;
    if (canvas && canvas !== watched) { watch.disconnect(); watch.observe(watched = canvas); }
    place();
  };
  const timer = setInterval(follow, 500);
  window.addEventListener("resize", place);
  listen(state => {
    const list = JSON.stringify(state.sensors);
    if (list !== listed) {
      listed = list;
      chips.replaceChildren(...state.sensors.map(({name, label}) => {
        const b = document.createElement("button");
        b.type = "button"; b.textContent = label; b.dataset.inset = name;
        b.addEventListener("click", e => { say([name, b.getAttribute("aria-pressed") !== "true"]); if (e.detail > 0) b.blur(); });
        return b;
      }));
    }
    for (const b of chips.children) {
      const on = b.dataset.inset in state.pictures;
      b.setAttribute("aria-pressed", on);
      b.title = `${on ? "Hide" : "Show"} what ${b.textContent} measures`;
    }
    for (const figure of [...pictures.children]) if (!(figure.dataset.inset in state.pictures)) figure.remove();
    for (const {name, label} of state.sensors) {
      if (!(name in state.pictures)) continue;
      let figure = [...pictures.children].find(f => f.dataset.inset === name);
      if (!figure) {
        figure = document.createElement("figure");
        figure.dataset.inset = name;
        const img = document.createElement("img"), caption = document.createElement("figcaption");
        img.alt = caption.textContent = label;
        figure.append(img, caption);
        pictures.appendChild(figure);
      }
      if (state.pictures[name]) figure.firstChild.src = `data:image/jpeg;base64,${state.pictures[name]}`;
    }
    follow();
  });
  return () => { clearInterval(timer); watch.disconnect(); window.removeEventListener("resize", place); box.remove(); style.remove(); };
