// Runs before anything else of a page: where a processor draws, edges are not smoothed, which takes a third of its time.
(() => {
  const create = HTMLCanvasElement.prototype.getContext;
  const drawsInSoftware = () => {
    const gl = create.call(document.createElement("canvas"), "webgl2");
    const info = gl?.getExtension("WEBGL_debug_renderer_info");
    const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    return /swiftshader|llvmpipe|software|basic render/i.test(name);
  };
  const isLow = () => {
    let chosen = null;
    try { chosen = localStorage.getItem("roboyard quality"); } catch { /* no storage: nothing was chosen */ }
    return chosen === "low" || (chosen !== "normal" && chosen !== "high" && drawsInSoftware());
  };
  let low = null;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    if (!/webgl/.test(kind)) return create.call(this, kind, options);
    low ??= isLow();
    return create.call(this, kind, low ? {...options, antialias: false} : options);
  };
})();
