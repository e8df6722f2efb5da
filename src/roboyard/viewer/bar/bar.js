// Buttons over the scene, the name and icon of the tab, and a note about a stopped server. The body of a
// function with `say` and `listen` (see PageScript); SPEEDS, VIEWS and ICON are filled in.
  const bar = document.createElement("div"), note = document.createElement("div");
  const style = document.createElement("style");
  style.textContent = `
    .roboyard-bar { position: fixed; top: 8px; z-index: 1000; display: flex; flex-wrap: wrap; gap: 2px 4px;
      align-items: center; justify-content: center; padding: 3px 6px; border-radius: 8px;
      font: 13px/1.3 system-ui, sans-serif; transform: translateX(-50%); box-sizing: border-box;
      color: var(--mantine-color-text, #222); background: var(--mantine-color-body, #fff);
      border: 1px solid var(--mantine-color-default-border, #ccc); box-shadow: 0 1px 6px rgba(0,0,0,.2); }
    .roboyard-bar button, .roboyard-bar select { height: 28px; min-width: 28px; border: 1px solid transparent;
      border-radius: 5px; background: transparent; color: inherit; font: inherit; padding: 0 5px; cursor: pointer; }
    .roboyard-bar select { background: var(--mantine-color-body, #fff); }
    .roboyard-bar button:hover, .roboyard-bar select:hover { border-color: #2660a4; }
    .roboyard-bar :focus-visible { outline: 2px solid #2660a4; outline-offset: 1px; }
    .roboyard-bar button[aria-pressed=true] { background: #2660a4; color: #fff; }
    .roboyard-bar svg { width: 16px; height: 16px; display: block; margin: auto; fill: currentColor;
      pointer-events: none; }  /* a click on a picture that changes while the button is down is lost */
    .roboyard-bar output { font-variant-numeric: tabular-nums; white-space: nowrap; padding: 0 4px;
      width: 150px; text-align: center; }
    .roboyard-bar.roboyard-strip { flex-wrap: nowrap; gap: 0 1px; padding: 0 2px; border-radius: 0;
      border-width: 0 0 1px; justify-content: space-between; font-size: 12px; box-shadow: none;
      opacity: .95; }  /* an opaque one lets Chromium cut the picture behind it at the bottom, too */
    .roboyard-strip button, .roboyard-strip select { height: 26px; min-width: 24px; padding: 0 2px; flex: 0 0 auto; }
    .roboyard-strip select { width: 62px; flex: 0 1 62px; min-width: 40px; text-overflow: ellipsis; }
    .roboyard-strip output { width: auto; flex: 1 1 60px; min-width: 0; padding: 0 2px; overflow: hidden;
      text-overflow: ellipsis; }
    .roboyard-note { position: fixed; top: 40%; left: 50%; transform: translate(-50%, -50%); z-index: 1001;
      max-width: 90vw; padding: 14px 18px; border-radius: 8px; font: 15px/1.4 system-ui, sans-serif;
      background: #7a1f1f; color: #fff; box-shadow: 0 2px 12px rgba(0,0,0,.4); }
    .roboyard-note[hidden], .roboyard-bar[hidden], .roboyard-bar [hidden] { display: none; }`;
  document.head.appendChild(style);
  bar.className = "roboyard-bar";
  bar.setAttribute("role", "toolbar");
  bar.setAttribute("aria-label", "Simulation");
  note.className = "roboyard-note";
  note.setAttribute("role", "alert");
  note.hidden = true;
  document.body.append(bar, note);

  const ICONS = {
    play: "M4 2l10 6-10 6z", pause: "M3 2h4v12H3zM9 2h4v12H9z", step: "M3 2l7 6-7 6zM11 2h2v12h-2z",
    reset: "M8 3a5 5 0 1 1-4.6 3l1.8.8A3 3 0 1 0 8 5v2.5L4 4l4-3.5z",
    forces: "M2 14h12v-2H2zM7 11h2V5h3L8 0 4 5h3z",
    picture: "M5.5 2h5l1 2H15v10H1V4h3.500zM8 6a3 3 0 1 0 0 6 3 3 0 0 0 0-6z", film: "M8 3a5 5 0 1 0 0 10A5 5 0 0 0 8 3z",
    stop: "M3 3h10v10H3z",
  };
  const icon = (button, name) => {
    if (button.dataset.icon === name) return;
    button.dataset.icon = name;
    button.innerHTML = `<svg viewBox="0 0 16 16" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;
  };
  const name = (element, text) => { element.setAttribute("aria-label", text); element.title = text; };
  const button = (kind, text, act) => {
    const b = document.createElement("button");
    b.type = "button"; b.dataset.bar = kind;
    icon(b, kind); name(b, text);
    b.addEventListener("click", e => { act(b); if (e.detail > 0) b.blur(); });
    bar.appendChild(b);
    return b;
  };
  const select = (kind, text, options, act) => {
    const s = document.createElement("select");
    s.dataset.bar = kind; name(s, text);
    for (const [value, label] of options) s.add(new Option(label, value));
    s.addEventListener("change", () => { act(s); s.blur(); });
    bar.appendChild(s);
    return s;
  };
  let state = {playing: true};
  const play = button("play", "Play", () => say(["play", !state.playing]));
  const step = button("step", "One step", () => say(["step"]));
  const reset = button("reset", "Reset", () => say(["reset"]));
  const speed = select("speed", "Speed", SPEEDS, s => say(["speed", s.value === "max" ? null : Number(s.value)]));
  const time = document.createElement("output");
  time.dataset.bar = "time"; name(time, "Simulated time, and how fast it passes");
  time.setAttribute("aria-live", "off");
  bar.appendChild(time);
  const view = select("view", "View", VIEWS, s => { say(["view", s.value]); s.value = ""; });
  const store = () => window.__viserMutable?.scene?.__r3f?.root?.getState?.();
  const BIAS = 0.04;  // m
  const CHOICE = "roboyard quality";  // read by early.js
  // In low quality, light is computed once per corner instead of per pixel: a processor draws three times faster.
  const LIT_CORNERS = `
    struct Sun { vec3 direction; vec3 color; };
    struct Sky { vec3 direction; vec3 skyColor; vec3 groundColor; };
    #if NUM_DIR_LIGHTS > 0
      uniform Sun directionalLights[NUM_DIR_LIGHTS];
    #endif
    #if NUM_HEMI_LIGHTS > 0
      uniform Sky hemisphereLights[NUM_HEMI_LIGHTS];
    #endif
    uniform vec3 ambientLightColor;
    varying vec3 vLight;
    varying vec3 vShine;
    void lightCorner(vec3 normal, vec3 place) {
      vec3 eye = normalize(-place), n = normalize(normal);
      if (dot(n, eye) < 0.0) n = -n;
      vLight = ambientLightColor;
      vShine = vec3(0.0);
      #if NUM_DIR_LIGHTS > 0
        for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
          vec3 l = directionalLights[i].direction, c = max(dot(n, l), 0.0) * directionalLights[i].color;
          vLight += c;
          float h = max(dot(n, normalize(l + eye)), 0.0), h2 = h * h, h4 = h2 * h2;
          vShine += c * h4 * h4 * h4 * h2 * 0.08;
        }
      #endif
      #if NUM_HEMI_LIGHTS > 0
        for (int i = 0; i < NUM_HEMI_LIGHTS; i++) {
          vec3 c = mix(hemisphereLights[i].groundColor, hemisphereLights[i].skyColor, 0.5 + 0.5 * dot(n, hemisphereLights[i].direction));
          vLight += c;
        }
      #endif
      vLight *= RECIPROCAL_PI;
      vShine *= RECIPROCAL_PI;
    }
    void main() {`;
  const PLAIN_PIXELS = `
    uniform vec3 diffuse;
    uniform float opacity;
    varying vec3 vLight;
    varying vec3 vShine;
    #include <common>
    #include <color_pars_fragment>
    #include <uv_pars_fragment>
    #include <map_pars_fragment>
    #include <fog_pars_fragment>
    #include <logdepthbuf_pars_fragment>
    #include <clipping_planes_pars_fragment>
    void main() {
      vec4 diffuseColor = vec4(diffuse, opacity);
      #include <clipping_planes_fragment>
      #include <logdepthbuf_fragment>
      #include <map_fragment>
      #include <color_fragment>
      gl_FragColor = vec4(diffuseColor.rgb * vLight + vShine, diffuseColor.a);
      #include <tonemapping_fragment>
      #include <colorspace_fragment>
      #include <fog_fragment>
    }`;
  let isLow = false, cheaper = null;
  const simplify = shader => {
    if (!isLow || !shader.vertexShader.includes("#include <fog_vertex>")) return;
    shader.vertexShader = shader.vertexShader.replace("void main() {", LIT_CORNERS)
      .replace("#include <fog_vertex>", "#include <fog_vertex>\n lightCorner(transformedNormal, mvPosition.xyz);");
    shader.fragmentShader = PLAIN_PIXELS;
  };
  const cheapen = scene => {  // one prototype: materials that arrive later are compiled once
    if (cheaper) return;
    scene.traverse(o => {
      const m = [o.material].flat()[0];
      if (cheaper || !o.isMesh || m?.type !== "MeshStandardMaterial") return;
      cheaper = Object.getPrototypeOf(m);
      cheaper.onBeforeCompile = simplify;
      cheaper.customProgramCacheKey = () => isLow ? "roboyard low" : "";
      scene.traverse(p => { for (const q of [p.material ?? []].flat()) q.needsUpdate = true; });
    });
  };
  // In low quality, a picture that stays as it is is drawn once more with all pixels. viser draws on each second and
  // after each message; then the picture is kept, but for each fifth time.
  const REST = 400, KEPT = 4, SMALL = 1e-4;  // ms, times, m
  let film = null, resting = null, seen = [], isSharp = false, kept = 0, watched = null;
  const look = (scene, camera) => {  // numbers that change with what is seen
    const canvas = watched.gl.domElement, values = [canvas.width, canvas.height];
    values.push(...camera.position, ...camera.quaternion, ...camera.projectionMatrix.elements);
    scene.traverseVisible(o => {
      values.push(o.id, ...o.position, ...o.quaternion, ...o.scale, ...o.matrix.elements);
      values.push(o.geometry?.id ?? 0, o.geometry?.attributes?.position?.version ?? 0, o.intensity ?? 0);
      for (const m of [o.material ?? []].flat()) values.push(m.id, m.version, m.opacity, m.color?.getHex?.() ?? 0);
    });
    return values;
  };
  const isSame = (a, b) => a.length === b.length && a.every((v, k) => Object.is(v, b[k]) || Math.abs(v - b[k]) < SMALL);
  const sharpen = () => {
    const three = store();
    if (!isLow || film || !three?.gl) return;
    three.gl.setPixelRatio(window.devicePixelRatio);
    watched.render.call(three.gl, three.scene, three.camera);
    seen = look(three.scene, three.camera);
    isSharp = true;
    kept = 0;
  };
  const watchRenders = gl => {
    if (watched?.gl === gl) return;
    watched = {gl, render: gl.render};
    gl.render = function (scene, camera) {
      if (isLow && gl.getRenderTarget() === null && scene === store().scene) {
        const now = look(scene, camera);
        if (!isSame(now, seen)) {
          if (isSharp) gl.setPixelRatio(store().viewport.dpr);
          isSharp = false;
          seen = look(scene, camera);
          clearTimeout(resting);
          resting = setTimeout(sharpen, REST);
        } else if (isSharp && !film) {
          kept += 1;
          return kept > KEPT ? sharpen() : undefined;
        }
      }
      return watched.render.call(this, scene, camera);
    };
  };
  let applied = "", redraws = 0;
  const applyQuality = () => {
    const three = store();
    if (!three?.gl) return;
    watchRenders(three.gl);
    if (!quality.dataset.chosen) {
      quality.dataset.chosen = "1";
      quality.value = window.__roboyardQuality();
      say(["quality", quality.value]);
    }
    isLow = quality.value === "low";
    cheapen(three.scene);
    const ratio = {low: 0.5, normal: 1, high: 2}[quality.value] * (quality.value === "high" ? 1 : window.devicePixelRatio);
    let again = false;
    const shadows = quality.value !== "low", wanted = `${ratio} ${shadows}`;
    // viser's own choice, which it would otherwise adapt to the rate of frames and set again at each render
    const settings = window.__viserTestpoints?.devSettings;
    if (settings) { if (settings.get().fixedDpr !== ratio) settings.set({fixedDpr: ratio}); }
    else if (Math.abs(three.viewport.dpr - ratio) > 1e-3) three.setDpr(ratio);
    three.scene.traverse(o => {  // curved surfaces would shade themselves in bands
      if (o.isDirectionalLight && o.castShadow && o.shadow.normalBias !== BIAS) { o.shadow.normalBias = BIAS; again = true; }
    });
    if (again) redraws = 3;
    if (redraws > 0) { redraws -= 1; window.__viserMutable.requestRender?.(); }  // the canvas takes its new size later
    if (wanted === applied && three.gl.shadowMap.enabled === shadows) return;
    applied = wanted;
    three.gl.shadowMap.enabled = shadows;
    three.scene.traverse(o => { if (o.isLight && o.shadow) { o.userData.casts ??= o.castShadow; o.castShadow = shadows && o.userData.casts; }
      if (o.material) for (const m of [o.material].flat()) m.needsUpdate = true; });
    redraws = 3;
    window.__viserMutable.requestRender?.();
  };
  const quality = select("quality", "Quality", [["low", "low quality"], ["normal", "normal"], ["high", "high quality"]],
    () => {
      quality.dataset.chosen = "1";
      try { localStorage.setItem(CHOICE, quality.value); } catch { /* no storage: the choice holds for this page */ }
      say(["quality", quality.value]);
      applyQuality();
    });
  quality.value = window.__roboyardQuality();
  const forces = button("forces", "Contact forces", () => say(["forces", !state.forces]));
  const stamp = () => new Date().toISOString().slice(0, 19).replace(/[:T]/g, "-");
  const keep = (blob, ending) => {
    const a = document.createElement("a");
    a.href = URL.createObjectURL(blob); a.download = `roboyard-${stamp()}.${ending}`; a.click();
    bar.dataset.kept = `${a.download} ${blob.size}`;
    setTimeout(() => URL.revokeObjectURL(a.href), 10000);
  };
  button("picture", "Save a picture", () => {
    const three = store();
    if (!three) return;
    if (isLow) sharpen();
    else three.gl.render(three.scene, three.camera);  // the drawn picture is gone after each frame
    three.gl.domElement.toBlob(blob => blob && keep(blob, "png"));
  });
  const filmButton = button("film", "Start a film", () => {
    if (film) { film.stop(); return; }
    const kind = ["video/mp4", "video/webm"].find(k => window.MediaRecorder?.isTypeSupported(k)), parts = [];
    if (!kind) return;
    film = new MediaRecorder(window.__viserMutable.canvas.captureStream(30), {mimeType: kind});
    film.ondataavailable = e => parts.push(e.data);
    film.onstop = () => {
      film = null;
      icon(filmButton, "film"); name(filmButton, "Start a film"); filmButton.setAttribute("aria-pressed", "false");
      keep(new Blob(parts, {type: kind}), kind.slice(6));
    };
    film.start(500);
    icon(filmButton, "stop"); name(filmButton, "Stop the film"); filmButton.setAttribute("aria-pressed", "true");
  });
  filmButton.style.color = "#c22";

  let tab = document.querySelector("link[rel~=icon]");
  if (!tab) { tab = document.createElement("link"); tab.rel = "icon"; document.head.appendChild(tab); }
  tab.type = "image/svg+xml"; tab.href = ICON;
  const STRIP = 670;  // least width of a picture with the whole bar (pixels)
  let wasStrip = false;
  const showTime = () => {  // on a narrow bar, the button alone says that it is paused
    if (state.time !== undefined)
      time.textContent = `${state.time} s` + (state.playing ? `  ${state.factor}×` : wasStrip ? "" : "  paused");
  };
  const place = () => {
    const box = window.__viserMutable?.canvas?.getBoundingClientRect();
    if (!box) return;
    const strip = box.width < STRIP;  // one row along the edge, which hides no robot
    if (bar.classList.toggle("roboyard-strip", strip) !== wasStrip) { wasStrip = strip; showTime(); }
    bar.style.left = `${box.left + box.width / 2}px`;
    bar.style.width = strip ? `${box.width}px` : "max-content";
    bar.style.maxWidth = strip ? "none" : `${box.width - 16}px`;
    bar.style.top = `${box.top + (strip ? 0 : 8)}px`;
  };
  const closeNote = () => {  // low quality is chosen already, and shown in the bar
    for (const n of document.querySelectorAll("[class*=Notification-root]"))
      if (/Software WebGL/.test(n.textContent)) n.querySelector("button")?.click();
  };
  const watch = new ResizeObserver(place);
  let canvasWatched = null;
  const pulse = () => {
    const canvas = window.__viserMutable?.canvas;
    if (canvas && canvas !== canvasWatched) { watch.disconnect(); watch.observe(canvasWatched = canvas); }
    place(); closeNote(); applyQuality(); if (state.title) document.title = state.title; };
  const timer = setInterval(pulse, 500), began = performance.now();
  const early = () => {  // before the first meshes are compiled
    if (cheaper || performance.now() - began > 20000) return;
    if (store()?.gl) applyQuality();
    requestAnimationFrame(early);
  };
  requestAnimationFrame(early);
  window.addEventListener("resize", place);
  listen(now => {
    state = now;
    bar.hidden = !now.visible;
    icon(play, now.playing ? "pause" : "play");
    name(play, now.playing ? "Pause" : "Play");
    speed.value = now.speed === null ? "max" : String(now.speed);
    showTime();
    forces.setAttribute("aria-pressed", String(now.forces));
    pulse();
  });
  pulse();

  // the page's own connection: viser tries again each second, but only in a focused window
  const closed = isClosed => {
    note.hidden = !isClosed;
    note.textContent = isClosed ? "The program that shows this page has stopped. " +
      "This page connects again when it runs again." : "";
    bar.inert = isClosed;
    if (isClosed) document.hasFocus = () => true; else delete document.hasFocus;
    if (isClosed) window.dispatchEvent(new Event("focus"));
  };
  window.__roboyardClosed = closed;
  closed(false);
  return () => {
    film?.stop();
    clearInterval(timer);
    clearTimeout(resting);
    if (watched) watched.gl.render = watched.render;
    watch.disconnect();
    window.removeEventListener("resize", place);
    delete document.hasFocus;
    delete window.__roboyardClosed;
    if (cheaper) { delete cheaper.onBeforeCompile; delete cheaper.customProgramCacheKey; cheaper = null; }
    for (const e of [bar, note, style]) e.remove();
  };
