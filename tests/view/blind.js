// A WebGL that draws nothing, ten times a second: viser needs one to start, and drawing without a
// graphics card takes seconds a frame on a busy machine. See test_view_drawing.py for what it draws.
(() => {
  window.requestAnimationFrame = (f) => setTimeout(() => f(performance.now()), 100);
  window.cancelAnimationFrame = clearTimeout;
  const real = HTMLCanvasElement.prototype.getContext;
  const facts = {
    7936: 'none', 7937: 'none', 7938: 'WebGL 2.0', 35724: 'WebGL GLSL ES 3.00',
    3088: [0, 0, 0, 0], 2978: [0, 0, 0, 0], 35661: 32, 34930: 16, 35660: 16, 34921: 16,
    36347: 1024, 36348: 30, 36349: 1024, 3379: 8192, 34076: 8192, 36183: 4,
  };
  const answers = {
    getContextAttributes: () => ({ alpha: true, antialias: false, depth: true, stencil: false }),
    getExtension: () => null,
    getSupportedExtensions: () => [],
    getParameter: (name) => facts[name] ?? 0,
    getShaderPrecisionFormat: () => ({ precision: 23, rangeMin: 127, rangeMax: 127 }),
    getProgramParameter: (_, name) => (name === 35718 || name === 35721 ? 0 : true),
    getShaderParameter: () => true,
    getShaderInfoLog: () => '',
    getProgramInfoLog: () => '',
    getError: () => 0,
    isContextLost: () => false,
    checkFramebufferStatus: () => 36053,
    clientWaitSync: () => 37146,
    getAttribLocation: () => 0,
    getUniformLocation: () => null,
  };
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    if (!kind.startsWith('webgl')) return real.call(this, kind, ...rest);
    const canvas = this;
    return (this.nothing ??= new Proxy({}, {
      get: (_, name) => {
        if (name === 'canvas') return canvas;
        if (name === 'drawingBufferWidth') return canvas.width;
        if (name === 'drawingBufferHeight') return canvas.height;
        if (name in answers) return answers[name];
        if (typeof name === 'string' && /^[A-Z0-9_]+$/.test(name)) return WebGL2RenderingContext[name];
        return () => ({});
      },
    }));
  };
})();
