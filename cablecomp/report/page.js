// Draws the figures of a page: unpacks plotly and their data, suits them to the width, to light or dark, to paper.
(async () => {
  const unpack = async (text) => {  // base 85 of RFC 1924, then zlib
    const digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
    const value = new Uint8Array(128);
    for (let i = 0; i < 85; i++) value[digits.charCodeAt(i)] = i;
    const pad = (5 - text.length % 5) % 5, padded = text + "~".repeat(pad);
    const bytes = new Uint8Array(padded.length / 5 * 4), view = new DataView(bytes.buffer);
    for (let i = 0, j = 0; i < padded.length; i += 5, j += 4) {
      let word = 0;
      for (let k = 0; k < 5; k++) word = word * 85 + value[padded.charCodeAt(i + k)];
      view.setUint32(j, word);
    }
    const stream = new Blob([bytes.subarray(0, bytes.length - pad)]).stream();
    return new Response(stream.pipeThrough(new DecompressionStream("deflate"))).text();
  };
  const numbers = (packed) => {  // steps between 16-bit numbers; 65535 stands for what is not finite
    let n = 0;
    return packed.steps.map((step) => ((n += step) < 65535 ? packed.low + packed.step * n : null));
  };
  const recolour = (text) => text.replace(/#[0-9a-f]{6}|rgba?\(\d+, \d+, \d+/gi, (c) => DARK[c.toLowerCase()] ?? c);
  const wrapped = (text) => String(text).replace(/(.{10,}?) /g, "$1<br>");

  const suit = (spec, width) => {  // less margin and smaller letters where there is little room
    const { data, layout } = spec;
    if (width > 560) return;
    const words = data.some((trace) => trace.orientation === "h");
    const axes = Object.keys(layout).filter((key) => /^[xy]axis/.test(key)).map((key) => layout[key]);
    layout.margin = { ...layout.template.layout.margin, ...layout.margin, l: 46, r: 12 };
    layout.font = { ...layout.font, size: 11 };
    for (const axis of axes) {
      axis.tickfont = { ...axis.tickfont, size: 10 };
      if (axis.title) axis.title.font = { size: 11 };
      if (axis.categoryarray) axis.categoryarray = axis.categoryarray.map(wrapped);
      if (!axis.tickvals && !axis.categoryarray && !words) axis.nticks = 5;
    }
    for (const note of layout.annotations ?? []) {
      note.font = { ...note.font, size: 10 };
      if (note.text) note.text = wrapped(note.text);
    }
    for (const trace of data) {
      if (trace.orientation === "h" && typeof trace.y?.[0] === "string") trace.y = Array.from(trace.y, wrapped);
      if (trace.textposition === "outside") trace.textfont = { size: 9 };
    }
    if (words && layout.xaxis.range) layout.xaxis.range = [layout.xaxis.range[0], 1.35 * layout.xaxis.range[1]];
    const beside = axes.filter((axis) => (axis.domain?.[0] ?? 0) > 0.2 && axis.title?.text).length;
    if (beside) for (const axis of axes) if (axis.title?.text) axis.title.text = wrapped(axis.title.text);
    const columns = Object.keys(layout).filter((key) => /^xaxis/.test(key) && layout[key].domain);
    const below = (axis) => layout[(axis.anchor ?? "x").replace("x", "xaxis")]?.domain?.[0] ?? 0;
    const titled = (axis) => axis.title?.text && below(axis) > 0.2;
    const named = Object.keys(layout).some((key) => /^yaxis/.test(key) && titled(layout[key]));
    for (const key of named ? columns : []) {  // room for the name of an axis between two columns
      const [from, to] = layout[key].domain;
      layout[key].domain = [from > 0.2 ? from + 0.06 : from, to < 0.8 ? to - 0.05 : to];
    }
    if (layout.legend?.orientation === "v") layout.legend = { orientation: "h", x: 0, y: -0.32, yanchor: "top" };
  };

  const notes = [...document.querySelectorAll("script.plot-data")];
  if (!notes.length) return;
  if (!("DecompressionStream" in window)) {
    for (const note of notes) note.previousElementSibling.textContent = "This browser is too old to draw figures.";
    return;
  }
  const library = document.createElement("script");
  library.textContent = await unpack(document.getElementById("plotly").textContent);
  document.head.append(library);
  const texts = new Map();
  for (const note of notes) texts.set(note, await unpack(note.textContent));

  const night = matchMedia("(prefers-color-scheme: dark)");
  const drawn = new Set();
  const draw = (note, paper = 0) => {
    const plot = note.previousElementSibling, colours = night.matches && !paper ? recolour : (text) => text;
    const spec = JSON.parse(colours(texts.get(note)));
    spec.layout.template = JSON.parse(colours(TEMPLATE));
    const width = paper || plot.clientWidth;
    for (const trace of spec.data)
      for (const key of ["x", "y"]) if (trace[key]?.steps) trace[key] = numbers(trace[key]);
    suit(spec, width);
    spec.layout.width = width;
    Plotly.react(plot, spec.data, spec.layout, { ...CONFIG, displayModeBar: width > 560 && !paper ? "hover" : false });
    drawn.add(note);
  };
  const again = () => { for (const note of drawn) if (note.previousElementSibling.clientWidth) draw(note); };
  for (const note of notes) {
    const fold = note.closest("details:not([open])");
    if (fold) fold.addEventListener("toggle", () => { if (fold.open) draw(note); });
    else draw(note);
  }
  night.addEventListener("change", again);
  let last = innerWidth, waiting = 0;
  addEventListener("resize", () => {
    if (innerWidth === last) return;
    last = innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(again, 150);
  });
  let shut = [];
  addEventListener("beforeprint", () => {  // everything, in light colours, as wide as a sheet
    shut = [...document.querySelectorAll("details:not([open])")];
    for (const fold of shut) fold.open = true;
    for (const note of notes) draw(note, note.closest(".columns") ? 330 : 690);
  });
  addEventListener("afterprint", () => {
    for (const fold of shut) fold.open = false;
    again();
  });
  document.body.dataset.drawn = "yes";
})();
