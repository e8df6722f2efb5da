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
  let software = null;
  const chosen = () => {  // in an earlier page of this browser
    try { return localStorage.getItem("roboyard quality"); } catch { return null; }  // no storage: nothing was chosen
  };
  window.__roboyardQuality = () => {
    const quality = chosen();
    return ["low", "normal", "high"].includes(quality) ? quality : (software ??= drawsInSoftware()) ? "low" : "normal";
  };
  let low = null;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    if (!/webgl/.test(kind)) return create.call(this, kind, options);
    low ??= window.__roboyardQuality() === "low";
    return create.call(this, kind, low ? {...options, antialias: false} : options);
  };
})();
