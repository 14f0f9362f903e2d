// The controls of a report's player; drawing.js draws.
(async () => {
  "use strict";
  const root = document.querySelector(".player");
  const find = (name, within = root) => within.querySelector(`.player-${name}`);
  const told = JSON.parse(find("data").textContent);
  const [x0, x1, y0, y1] = told.view;
  const STEP_MS = 500; // how long a frame stays where motion is to be reduced
  const SLOW_MS = 1000 / 30; // a frame that takes longer; a few of them, and it is drawn coarser
  const SAY_MS = 100; // between two figures while it plays: none could be read faster
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  const dark = matchMedia("(prefers-color-scheme: dark)");

  function between(time, values, t) {
    const [k, share] = playerDrawing.locate(time, t);
    return values[k] + share * (values[k + 1] - values[k]);
  }

  const colour = (name) => getComputedStyle(root).getPropertyValue(`--player-${name}`).trim();
  const across = (x) => (1000 * (x - x0)) / (x1 - x0);
  const down = (y) => (1000 * (y1 - y)) / (x1 - x0);
  const path = (xs, ys) => xs.map((x, i) => `${i ? "L" : "M"}${x.toFixed(1)} ${ys[i].toFixed(1)}`)
    .join("");

  const player = {
    t: told.start, end: 0, playing: false, touched: false, next: 0, said: 0, quantity: null,
    views: [...root.querySelectorAll(".player-view")], drawing: null, sides: [],
  };
  root.player = player;

  const draw = () => player.drawing.draw(
    player.t, find("stage"), player.views, find("lines").checked, colour);

  function moveCursors() {
    for (const cursor of root.querySelectorAll(".player-cursor")) {
      cursor.style.transform = `translateX(${(100 * player.t) / player.end}%)`;
    }
  }

  function sayEnergies() {
    for (const box of root.querySelectorAll(".player-energy")) {
      for (const { engine, energy } of player.sides) {
        const value = between(energy.time, energy[box.dataset.energy], player.t);
        box.querySelector(`span.player-${engine} span`).textContent = value.toFixed(3);
      }
    }
  }

  function show() {
    draw();
    moveCursors();
    const now = performance.now();
    if (player.playing && now < player.said + SAY_MS) return;
    player.said = now;
    sayEnergies();
    const { t, end } = player, scrubber = find("scrubber");
    const words = [`${t.toFixed(3)} s`, `${(t / told.scale).toFixed(2)} √(H/g)`];
    scrubber.value = Math.round((1000 * t) / end);
    scrubber.setAttribute("aria-valuetext", words.join(", "));
    find("time").textContent = `t = ${words.join(" = ")}`;
  }

  function seek(t) {
    player.t = Math.min(player.end, Math.max(0, t));
    player.touched = true;
    show();
  }

  // By stored frames of the continuum.
  function step(count) {
    const { time } = player.sides[0], slack = 1e-6 * player.end;
    let k = time.findIndex((t) => t > player.t + slack);
    if (k < 0) k = time.length;
    if (count > 0) return seek(k + count - 1 < time.length ? time[k + count - 1] : player.end);
    const before = time.filter((t) => t < player.t - slack);
    seek(before[Math.max(0, before.length + count)] || 0);
  }

  function play(on) {
    player.playing = on;
    cancelAnimationFrame(player.next);
    const button = find("play");
    button.classList.toggle("playing", on);
    button.setAttribute("aria-label", on ? "Pause" : "Play");
    if (!player.drawing) return;
    player.drawing.coarsen(1);
    if (!on) return show();
    if (!player.touched || player.t >= player.end) seek(0);
    let last = performance.now(), slow = 0;
    const advance = (now) => {
      const passed = Math.max(0, now - last);
      if (!calm.matches || passed >= STEP_MS) {
        last = now;
        if (calm.matches) step(1);
        else seek(player.t + passed / 1000 / Number(find("speed").value));
        slow = passed > SLOW_MS && !calm.matches ? slow + 1 : Math.max(0, slow - 1);
        if (slow > 5) {
          player.drawing.coarsen(0.8);
          slow = 0;
        }
      }
      if (player.t >= player.end) play(false);
      else player.next = requestAnimationFrame(advance);
    };
    player.next = requestAnimationFrame(advance);
  }

  function legend(quantity) {
    const chip = (css, words) => {
      const i = document.createElement("i"), span = document.createElement("span");
      i.style.background = css;
      span.append(i, ` ${words}`);
      span.style.cssText = "display: inline-flex; gap: 4px; align-items: center";
      return span;
    };
    const parts = quantity.classes.map((words, k) => chip(quantity.css(k + 1), words));
    if (!parts.length && quantity.name !== "id") {
      const stops = Array.from({ length: 18 }, (_, i) => quantity.css(1 + Math.round(14.9 * i)));
      const scale = document.createElement("i"), [low, high] = ["low", "high"].map((end) => {
        const span = document.createElement("span");
        span.textContent = end === "low" ? `≤ ${quantity.low}` : `≥ ${quantity.high}`;
        return span;
      });
      if (quantity.low === "0") low.textContent = "0";
      high.textContent += quantity.unit === "–" ? "" : ` ${quantity.unit}`;
      scale.className = "player-scale";
      scale.style.background = `linear-gradient(90deg, ${stops})`;
      parts.push(low, scale, high);
    }
    if (quantity.note) parts.push(Object.assign(document.createElement("span"),
      { textContent: quantity.note, style: "white-space: normal" }));
    const lacks = ({ channels }) => !channels[quantity.name]?.codes.every((code) => code > 0);
    if (player.sides.some(lacks)) {
      parts.push(chip("var(--player-unknown)", "not known"));
    }
    find("legend").replaceChildren(...parts);
  }

  function colourBy(name) {
    const quantity = told.quantities.find((one) => one.name === name);
    player.quantity = quantity;
    find("quantity").value = name;
    legend(quantity);
    root.querySelectorAll(".player-says").forEach((says, i) => {
      const { unknown, mapped } = player.sides[i];
      says.textContent = unknown[name] ? `not known, grey: ${unknown[name]}`
        : mapped.includes(name) ? "by the mapped cell that a grain lies in" : "";
    });
    for (const side of player.sides) side.colourBy(quantity);
    show();
  }

  // What stays as it is: floor and column, ticks, energy curves, the speed to begin with.
  function drawOnce() {
    const { length, height } = told;
    const column = `M${across(0)} ${down(height)}H${across(length)}V${down(0)}`;
    root.querySelectorAll(".player-side").forEach((box) => {
      find("floor", box).setAttribute("d", `M${across(0)} 0V${down(0)}H1000`);
      find("column", box).setAttribute("d", column);
      const step = Math.max(1, Math.ceil((x1 / length) / 8));
      const ticks = find("ticks", box);
      for (let x = 0; x * length <= x1; x += step) {
        const tick = document.createElement("span");
        tick.style.left = `${across(x * length) / 10}%`;
        tick.textContent = x ? x : "x/L0 = 0";
        if (!x) tick.style.transform = "none";
        if (across(x * length) > 960) tick.style.transform = "translateX(-100%)";
        ticks.append(tick);
      }
    });
    for (const box of root.querySelectorAll(".player-energy")) {
      const name = box.dataset.energy;
      const top = Math.max(...player.sides.flatMap((side) => side.energy[name]));
      const bottom = Math.min(0, ...player.sides.flatMap((side) => side.energy[name]));
      const y = (value) => 980 - (960 * (value - bottom)) / (top - bottom);
      find("axis", box).setAttribute("d", `M0 0V1000M0 ${y(0)}H1000`);
      for (const { engine, energy } of player.sides) {
        const xs = energy.time.map((t) => (1000 * t) / player.end);
        box.querySelector(`path.player-${engine}`).setAttribute("d", path(xs, energy[name].map(y)));
      }
      const ends = find("range", box).children;
      ends[0].textContent = `0 to ${top.toPrecision(2)} E0`;
      ends[1].textContent = `t to ${(player.end / told.scale).toFixed(1)} √(H/g)`;
    }
    const far = (option) => Math.abs(Math.log((player.end * option.value) / 8)); // 8 s to watch
    find("speed").value = [...find("speed").options]
      .reduce((a, b) => (far(b) < far(a) ? b : a)).value;
  }

  function listen() {
    find("play").addEventListener("click", () => play(!player.playing));
    find("scrubber").addEventListener("input", (event) =>
      seek((player.end * event.target.value) / 1000));
    find("quantity").addEventListener("change", (event) => colourBy(event.target.value));
    find("lines").addEventListener("change", show);
    for (const view of player.views) view.addEventListener("click", () => play(!player.playing));
    for (const chart of root.querySelectorAll(".player-energy svg")) {
      const to = (event) => {
        const { left, width } = chart.getBoundingClientRect();
        seek((player.end * (event.clientX - left)) / width);
      };
      chart.addEventListener("pointerdown", to);
      chart.addEventListener("pointermove", (event) => event.buttons && to(event));
    }
    const keys = {
      " ": () => play(!player.playing), ArrowRight: () => step(1), ArrowLeft: () => step(-1),
      ArrowUp: () => step(1), ArrowDown: () => step(-1), PageUp: () => step(10),
      PageDown: () => step(-10), Home: () => seek(0), End: () => seek(player.end),
    };
    root.addEventListener("keydown", (event) => {
      const own = event.target.matches("select") ||
        (event.key === " " && event.target.matches("button, input[type=checkbox]"));
      if (own || !keys[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      keys[event.key]();
    });
    for (const query of [dark, calm]) query.addEventListener("change", show);
  }

  function still(why) {
    play(false);
    find("why").textContent = `${why} There is a picture of three instants instead of the player, `
      + "and the figures below.";
    root.dataset.state = "still";
  }

  if (!window.DecompressionStream) return still("This browser cannot unpack the frames.");
  const gl = root.querySelector("canvas").getContext("webgl", { alpha: false, antialias: false });
  if (!gl) return still("This browser has no WebGL.");
  find("why").textContent = "Unpacking the frames …";
  player.drawing = await playerDrawing.load(told, gl, find("three").textContent, calm);
  player.sides = player.drawing.sides;
  player.end = Math.max(...player.sides.map((side) => side.time[side.time.length - 1]));
  root.dataset.state = "live";
  drawOnce();
  listen();
  new ResizeObserver(([entry]) => {
    const { width, height } = entry.contentRect;
    player.drawing.renderer.setSize(width, height, false);
    draw();
  }).observe(find("stage"));
  gl.canvas.addEventListener("webglcontextlost", () => still("The browser took WebGL away."));
  Object.assign(player, { seek, play, draw, colourBy });
  colourBy(told.quantities[0].name);
  root.dataset.ready = "yes";
})();
