// Unpacks the frames of a player and draws them with three.js; player.js has its controls.
const playerDrawing = (() => {
  "use strict";
  const ABSENT = 65535, LAST = 65534; // of packing.py

  const VERTEX = `
    precision highp float;
    attribute vec4 position;   // x, y of a frame and of the next, as codes over 65535
    attribute vec4 state;      // value in both frames, depth in both
    attribute float size;
    uniform mat4 projectionMatrix, modelViewMatrix;
    uniform vec4 box;          // x, y of code 0, and from there to code 65535
    uniform float between, pixels, largest;
    varying float value;
    void main() {
      vec2 place = box.xy + box.zw * mix(position.xy, position.zw, between);
      float depth = mix(state.z, state.w, between);
      gl_Position = projectionMatrix * modelViewMatrix * vec4(place, depth, 1.0);
      gl_PointSize = max(1.5, 2.0 * largest * size * pixels);
      if (max(position.x, position.z) > 0.999992) gl_Position = vec4(9.0, 9.0, 9.0, 1.0);
      bool known = state.x > 0.0 && state.y > 0.0;
      value = known && SMOOTH == 1 ? mix(state.x, state.y, between)
            : between < 0.5 ? state.x : state.y;
    }`;
  const FRAGMENT = `
    precision highp float;
    uniform sampler2D colours;
    uniform vec3 unknown;
    varying float value;
    void main() {
      vec3 colour = unknown;
      if (value > 0.002) colour = texture2D(colours, vec2((255.0 * value + 0.5) / 256.0, 0.5)).rgb;
      if (ROUND == 1) {           // a ball, lit a little from above, so that neighbours stand apart
        vec2 at = 2.0 * gl_PointCoord - 1.0;
        float r = dot(at, at);
        if (r > 1.0) discard;
        colour *= 1.0 - 0.38 * r * r + 0.1 * (1.0 - r) * (at.x - at.y) * -0.5;
      }
      gl_FragColor = vec4(colour, 1.0);
    }`;

  // A line of some width: two vertices at each of its places, moved apart by pixels.
  const LINE_VERTEX = `
    precision highp float;
    attribute vec2 position, normal;
    attribute float across, along;
    uniform mat4 projectionMatrix, modelViewMatrix;
    uniform vec2 view;
    uniform float width;
    varying float offset, run;
    void main() {
      float reach = 0.5 * width + 1.0;
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 0.0, 1.0);
      gl_Position.xy += 2.0 * across * reach * normal / view;
      offset = across * reach;
      run = along;
    }`;
  const LINE_FRAGMENT = `
    precision highp float;
    uniform vec3 colour;
    uniform float width, opacity, dash;
    varying float offset, run;
    void main() {
      if (dash > 0.0 && mod(run, 1.6 * dash) > dash) discard;
      gl_FragColor = vec4(colour, opacity * clamp(0.5 + 0.5 * width - abs(offset), 0.0, 1.0));
    }`;

  const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

  async function inflate(text) {
    const stream = new Blob([bytesOf(text)]).stream();
    const whole = stream.pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(whole).arrayBuffer());
  }

  // Codes of a channel, frame after frame.
  async function decode({ bits, frames, count, data }) {
    const bytes = await inflate(data), total = frames * count;
    let codes = bytes;
    if (bits === 16) {
      codes = new Uint16Array(total);
      for (let i = 0; i < total; ++i) codes[i] = (bytes[i] << 8) | bytes[total + i];
    }
    for (let i = count; i < total; ++i) codes[i] += codes[i - count]; // modulo, as the array is
    return { codes, frames, count };
  }

  // The frame that a time lies in, and how far it is to the next: 0 to 1.
  function locate(time, t) {
    let k = 0, end = time.length - 2;
    while (k < end && time[k + 1] <= t) ++k;
    const share = (t - time[k]) / (time[k + 1] - time[k]);
    return [k, Math.min(1, Math.max(0, share))];
  }

  // One side: its channels, and the points that three.js draws of them.
  class Side {
    constructor(told, channels, box, calm) {
      Object.assign(this, told, { channels, calm, shown: "", count: channels.x.count });
      const { codes } = channels.size;
      const geometry = new THREE.BufferGeometry();
      const attribute = (name, array, length) => {
        const made = new THREE.BufferAttribute(array, length, true);
        geometry.setAttribute(name, made);
        return made;
      };
      this.places = attribute("position", new Uint16Array(4 * this.count), 4);
      this.state = attribute("state", new Uint8Array(4 * this.count), 4);
      attribute("size", Uint16Array.from(codes), 1);
      // The front first, so that what it hides is not coloured in vain.
      const z = channels.z.codes, order = Array.from({ length: this.count }, (_, i) => i);
      geometry.setIndex(order.sort((a, b) => z[b] - z[a]));
      const [[bx0, bx1], [by0, by1]] = box;
      const stretch = ABSENT / LAST;
      this.uniforms = {
        box: { value: new THREE.Vector4(bx0, by0, stretch * (bx1 - bx0), stretch * (by1 - by0)) },
        between: { value: 0 }, pixels: { value: 1 }, largest: { value: stretch * this.largest },
        colours: { value: null }, unknown: { value: new THREE.Color() },
      };
      this.points = new THREE.Points(geometry, this.material(true));
      this.points.frustumCulled = false; // three.js would take codes for places
      this.scene = new THREE.Scene();
      this.scene.add(this.points);
      this.line = lineOf(channels.surface.count);
      this.lines = [];
    }

    material(smooth) {
      return new THREE.RawShaderMaterial({
        vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: this.uniforms,
        depthFunc: THREE.LessDepth,
        defines: { SMOOTH: Number(smooth), ROUND: Number(this.engine === "dem") },
      });
    }

    colourBy(quantity) {
      this.quantity = quantity.name;
      this.points.material.dispose();
      this.points.material = this.material(!quantity.classes.length && quantity.name !== "id");
      this.uniforms.colours.value = quantity.texture;
      this.shown = "";
    }

    // Frames from which a time is drawn: both the same where nothing is to be interpolated.
    frames(t) {
      const [k, share] = locate(this.time, t);
      if (this.smooth && !this.calm.matches) return [k, k + 1, share];
      const nearest = share < 0.5 ? k : k + 1;
      return [nearest, nearest, 0];
    }

    at(t) {
      const [a, b, share] = this.frames(t);
      this.uniforms.between.value = share;
      if (this.shown === `${a} ${b}`) return;
      this.shown = `${a} ${b}`;
      const { x, y, z } = this.channels, values = this.channels[this.quantity];
      const n = this.count, places = this.places.array, state = this.state.array;
      const [va, vb] = values ? [a, b].map((k) => (values.frames > 1 ? k * n : 0)) : [0, 0];
      for (let i = 0; i < n; ++i) {
        const i4 = 4 * i, ia = a * n + i, ib = b * n + i;
        places[i4] = x.codes[ia];
        places[i4 + 1] = y.codes[ia];
        places[i4 + 2] = x.codes[ib];
        places[i4 + 3] = y.codes[ib];
        state[i4] = values ? values.codes[va + i] : 0;
        state[i4 + 1] = values ? values.codes[vb + i] : 0;
        state[i4 + 2] = z.codes[ia];
        state[i4 + 3] = z.codes[ib];
      }
      this.places.needsUpdate = this.state.needsUpdate = true;
    }

    // Moves the line of the free surface to a time; `metre` in pixels.
    surfaceAt(t, metre) {
      const [a, b, share] = this.frames(t), { codes, count } = this.channels.surface;
      const { position, normal, along } = this.line.attributes, [from, step] = this.columns;
      const height = (i) => (this.top / LAST) *
        ((1 - share) * codes[a * count + i] + share * codes[b * count + i]);
      let last = 0, run = 0;
      for (let i = 0; i < count; ++i) {
        const y = height(i), back = Math.max(0, i - 1), next = Math.min(count - 1, i + 1);
        if (y > 0) last = i;
        const dx = step * (next - back), dy = height(next) - height(back);
        const length = Math.hypot(dx, dy);
        if (i) run += metre * Math.hypot(step, y - height(i - 1));
        for (const k of [2 * i, 2 * i + 1]) {
          position.setXY(k, from + step * i, y);
          normal.setXY(k, -dy / length, dx / length);
          along.setX(k, run);
        }
      }
      this.line.setDrawRange(0, 6 * Math.min(count - 1, last + 1));
      position.needsUpdate = normal.needsUpdate = along.needsUpdate = true;
    }
  }

  // Geometry of a line through `count` places, which surfaceAt moves.
  function lineOf(count) {
    const geometry = new THREE.BufferGeometry(), across = new Float32Array(2 * count), index = [];
    const add = (name, length, array = new Float32Array(2 * count * length)) =>
      geometry.setAttribute(name, new THREE.BufferAttribute(array, length));
    for (let i = 0; i < count; ++i) {
      across.set([-1, 1], 2 * i);
      if (i) index.push(2 * i - 2, 2 * i - 1, 2 * i, 2 * i, 2 * i - 1, 2 * i + 1);
    }
    add("position", 2);
    add("normal", 2);
    add("along", 1);
    add("across", 1, across);
    geometry.setIndex(index);
    return geometry;
  }

  // All that is drawn: the sides beside each other on one canvas, `told.view` of each.
  class Drawing {
    constructor(gl, told, sides) {
      Object.assign(this, { told, sides, drawn: 0, viewSize: { value: new THREE.Vector2() } });
      const [x0, x1, y0, y1] = told.view;
      this.full = Math.min(2, window.devicePixelRatio || 1);
      this.renderer = new THREE.WebGLRenderer({ canvas: gl.canvas, context: gl });
      this.renderer.setPixelRatio(this.full);
      this.renderer.autoClear = false;
      this.renderer.setScissorTest(true);
      this.camera = new THREE.OrthographicCamera(x0, x1, y1, y0, -1, 2);
      this.camera.position.z = 1; // the front of the slab, depth 1, is nearest
      for (const quantity of told.quantities) {
        const bytes = bytesOf(quantity.colours);
        quantity.texture = new THREE.DataTexture(bytes, 256, 1, THREE.RGBFormat);
        quantity.texture.needsUpdate = true;
        quantity.css = (code) => `rgb(${bytes.slice(3 * code, 3 * code + 3).join(",")})`;
      }
      sides.forEach((side, i) => this.addLines(side, sides[1 - i]));
    }

    // In a side's scene the surface of the other, dashed, below its own, both on a rim of the
    // page's colour.
    addLines(side, other) {
      [other, side].forEach((of, j) => {
        for (const rim of [true, false]) {
          const mesh = new THREE.Mesh(of.line, new THREE.RawShaderMaterial({
            vertexShader: LINE_VERTEX, fragmentShader: LINE_FRAGMENT, transparent: true,
            depthTest: false, side: THREE.DoubleSide, uniforms: {
              colour: { value: new THREE.Color() }, opacity: { value: rim ? 0.75 : 1 },
              width: { value: rim ? 4.5 : 2.2 }, dash: { value: of === side || rim ? 0 : 6 },
              view: this.viewSize,
            },
          }));
          mesh.frustumCulled = false;
          mesh.renderOrder = 1 + 2 * j + !rim;
          mesh.userData.colour = rim ? "paper" : of.engine;
          side.lines.push(mesh);
          side.scene.add(mesh);
        }
      });
    }

    // A share of the full resolution, for machines that are too slow for all of it.
    coarsen(share) {
      const ratio = Math.max(0.5, share * this.renderer.getPixelRatio());
      this.renderer.setPixelRatio(share === 1 ? this.full : ratio);
    }

    // An instant, with the free surfaces or without, on `views` of a stage, elements of the page;
    // `colour` gives that of a name.
    draw(t, stage, views, lines, colour) {
      const { renderer, sides } = this, [x0, x1] = this.told.view;
      const whole = stage.getBoundingClientRect();
      const { width, height } = views[0].getBoundingClientRect();
      const colours = Object.fromEntries(["ground", "unknown", "paper", "mpm", "dem"].map((name) =>
        [name, new THREE.Color(colour(name))]));
      this.viewSize.value.set(width, height);
      for (const side of sides) side.surfaceAt(t, width / (x1 - x0));
      renderer.setScissor(0, 0, whole.width, whole.height);
      renderer.setClearColor(colours.paper);
      renderer.clear();
      renderer.setClearColor(colours.ground);
      sides.forEach((side, i) => {
        const view = views[i].getBoundingClientRect();
        const place = [view.left - whole.left, whole.bottom - view.bottom, view.width, view.height];
        side.at(t);
        side.uniforms.unknown.value = colours.unknown;
        side.uniforms.pixels.value = (renderer.getPixelRatio() * view.width) / (x1 - x0);
        for (const line of side.lines) {
          line.visible = lines;
          line.material.uniforms.colour.value = colours[line.userData.colour];
        }
        renderer.setViewport(...place);
        renderer.setScissor(...place);
        renderer.clear();
        renderer.render(side.scene, this.camera);
      });
      ++this.drawn;
    }
  }

  // The drawing of what the page tells, on a context of WebGL; `calm` matches where motion is to be
  // reduced.
  async function load(told, gl, three, calm) {
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await inflate(three));
    document.head.append(script); // runs at once
    const sides = [];
    for (const side of told.sides) {
      const names = Object.keys(side.channels);
      const unpacked = await Promise.all(names.map((name) => decode(side.channels[name])));
      const channels = Object.fromEntries(names.map((name, i) => [name, unpacked[i]]));
      sides.push(new Side(side, channels, told.box, calm));
    }
    return new Drawing(gl, told, sides);
  }

  return { load, locate };
})();
